"""`ippon certificates`: a certificate authority, and a certificate for each role."""

import datetime as dt

from app.certificates.roles import write_roles
from app.cli.options.certificates import Certificates
from app.errors import UsageError


def run_certificates(command: Certificates) -> int:
    """Write the files and print what each role starts with."""
    now = dt.datetime.now(dt.UTC)
    try:
        roles = write_roles(
            command.folder, robots=command.robot, hosts=command.hosts, days=command.days, now=now
        )
    except (ValueError, OSError) as error:
        raise UsageError(str(error)) from error
    for role in roles:
        until = f"until {role.expires:%Y-%m-%d}"
        state = "EXPIRED" if role.expires < now else "new" if role.new else "kept"
        print(f"{role.role:<10} {state:<8} {until}  IPPON_ZENOH_PROFILE={role.profile}")
    print(f"{command.folder / 'ca.key'} signs certificates: keep it off the robots")
    return 0
