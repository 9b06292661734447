"""Certificates of all processes of a robot, with the zenoh profiles that name them."""

import datetime as dt
import ipaddress
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final

from app.certificates.authority import (
    CertificateError,
    expiry,
    general_name,
    host_names,
    issue,
    open_authority,
    write_private,
)
from app.links.loopback import HOSTS
from app.messages import keys
from app.messages.keys import check_prefix

NAVIGATOR: Final = "navigator"
ROLES: Final = (NAVIGATOR, "robot", "console", "requester", "recorder")
TEMPLATE_FOLDER: Final = "/etc/ippon/tls"
_KEY: Final = re.compile(r'"ippon/([^"]+)"')
"""A key of the template's robot."""
_LABEL: Final = r"[A-Za-z0-9_]([A-Za-z0-9_-]{0,61}[A-Za-z0-9_])?"
_HOST: Final = re.compile(rf"({_LABEL}\.)*(?!\d+$){_LABEL}")
"""Name of a host; its last part is no number: that would be a wrong address."""
_LONGEST_HOST: Final = 253


@dataclass(frozen=True, slots=True, kw_only=True)
class RoleFiles:
    """What a role got."""

    role: str
    profile: Path
    """zenoh configuration that names its certificate."""
    expires: dt.datetime
    new: bool
    """Written now; else it was there."""
    lacks: tuple[str, ...] = ()
    """Hosts and robots that are wanted and that its files, which were there, do not name."""


def write_roles(
    folder: Path,
    *,
    robots: Sequence[str],
    hosts: Sequence[str],
    days: int,
    now: dt.datetime,
) -> list[RoleFiles]:
    """Write what each role lacks; files that are there stay.

    Args:
        folder: Gets ca.pem and ca.key, and of each role certificate, key and zenoh profile.
        robots: Key prefixes that the access rules are about.
        hosts: Names and addresses of the navigator's machine.
        days: How long certificates are valid.
        now: The present time, with its time zone.

    Raises:
        CertificateError: A host or a number of days makes no sense, or the folder holds something
            that is not ours.
        ValueError: A prefix is none.
        OSError: The folder cannot be written.
    """
    _check(robots, hosts, days)
    folder = folder.absolute()
    if set('"\\') & set(str(folder)):
        raise CertificateError(f"zenoh's profiles cannot name {folder}: take a plain path")
    folder.mkdir(parents=True, exist_ok=True)
    authority = open_authority(folder, now)
    written: list[RoleFiles] = []
    for role in ROLES:
        certificate, key = folder / f"{role}.pem", folder / f"{role}.key"
        new = not (certificate.exists() and key.exists())
        if new:
            # Processes beside the navigator reach it here, whatever others call its machine.
            here = (*hosts, *HOSTS) if role == NAVIGATOR else ("localhost",)
            reached = tuple(dict.fromkeys(here))
            pem, private = issue(authority, role, reached, days, now)
            write_private(key, private)
            certificate.write_bytes(pem)
        profile = folder / f"{role}.json5"
        if not profile.exists():
            profile.write_text(profile_of(role, folder, robots), encoding="utf-8")
        try:
            expires, named = expiry(certificate.read_bytes()), host_names(certificate.read_bytes())
        except ValueError as error:
            raise CertificateError(f"{certificate} is no certificate: {error}") from error
        lacks = _lacking(profile, named, robots, hosts) if role == NAVIGATOR else ()
        written.append(RoleFiles(role=role, profile=profile, expires=expires, new=new, lacks=lacks))
    return written


def _check(robots: Sequence[str], hosts: Sequence[str], days: int) -> None:
    if not robots:
        raise CertificateError("the access rules are about at least one robot; none is named")
    for robot in robots:
        check_prefix(robot)
    if not 1 <= days <= 3650:
        raise CertificateError(f"certificates are valid for 1 to 3650 days; got {days}")
    for host in hosts:
        if not _is_host(host):
            raise CertificateError(
                f"{host!r} is neither a host's name nor an address, such as robot.local, "
                "192.168.1.20 or fd00::20; a port is not part of it"
            )


def _lacking(
    profile: Path, named: Sequence[str], robots: Sequence[str], hosts: Sequence[str]
) -> tuple[str, ...]:
    """Return the hosts that are not named, and the robots that the rules of a profile leave out."""
    rules = profile.read_text("utf-8")
    unnamed = [host for host in hosts if str(general_name(host).value) not in named]
    return (*unnamed, *(robot for robot in robots if f'"{robot}/{keys.CMD_VEL}"' not in rules))


def _is_host(text: str) -> bool:
    try:
        # An address with a zone, such as fe80::1%eth0, means another machine elsewhere.
        return "%" not in str(ipaddress.ip_address(text))
    except ValueError:
        return len(text) <= _LONGEST_HOST and _HOST.fullmatch(text) is not None


def profile_of(role: str, folder: Path, robots: Sequence[str]) -> str:
    """Return the zenoh configuration of a role.

    Args:
        role: One of `ROLES`.
        folder: Where its certificate lies.
        robots: Key prefixes.
    """
    template = NAVIGATOR if role == NAVIGATOR else "client"
    text = (resources.files("app.certificates") / f"{template}.json5").read_text("utf-8")
    text = text.replace(f"{TEMPLATE_FOLDER}/client", f"{folder.as_posix()}/{role}")
    text = text.replace(TEMPLATE_FOLDER, folder.as_posix())

    def of_all(key: re.Match[str]) -> str:
        return ", ".join(f'"{robot}/{key[1]}"' for robot in robots)

    return _KEY.sub(of_all, text)
