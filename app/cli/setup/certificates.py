"""`ippon certificates`: a certificate authority, and a certificate for each role."""

import datetime as dt
import sys
from pathlib import Path
from typing import Final

from app.certificates.roles import write_roles
from app.cli.options.certificates import Certificates
from app.errors import UsageError

_DEFAULTS: Final = (*Certificates(folder=Path()).hosts, *Certificates(folder=Path()).robot)
"""What nobody has asked for in words."""


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
        asked = [name for name in role.lacks if name not in _DEFAULTS]
        if asked:
            print(
                f"ippon: the {role.role}'s files were there and do not name {', '.join(asked)}: "
                f"delete {role.role}.pem and {role.profile.name} to have them made again",
                file=sys.stderr,
            )
    print(f"{command.folder / 'ca.key'} signs certificates: keep it off the robots")
    return 0
