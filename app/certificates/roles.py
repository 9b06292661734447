"""Certificates of all processes of a robot, with the zenoh profiles that name them."""

import datetime as dt
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final

from app.certificates.authority import (
    CertificateError,
    expiry,
    issue,
    open_authority,
    write_private,
)
from app.messages.keys import check_prefix

NAVIGATOR: Final = "navigator"
ROLES: Final = (NAVIGATOR, "robot", "console", "requester", "recorder")
TEMPLATE_FOLDER: Final = "/etc/ippon/tls"
_KEY: Final = re.compile(r'"ippon/([^"]+)"')
"""A key of the template's robot."""
_HOST: Final = re.compile(r"[A-Za-z0-9]([A-Za-z0-9.:-]{0,252}[A-Za-z0-9])?")


@dataclass(frozen=True, slots=True, kw_only=True)
class RoleFiles:
    """What a role got."""

    role: str
    profile: Path
    """zenoh configuration that names its certificate."""
    expires: dt.datetime
    new: bool
    """Written now; else it was there."""


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
    if not robots:
        raise CertificateError("the access rules are about at least one robot; none is named")
    for robot in robots:
        check_prefix(robot)
    if not 1 <= days <= 3650:
        raise CertificateError(f"certificates are valid for 1 to 3650 days; got {days}")
    for host in hosts:
        if _HOST.fullmatch(host) is None:
            raise CertificateError(f"{host!r} is neither a host's name nor an address")
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
            reached = hosts if role == NAVIGATOR else ("localhost",)
            pem, private = issue(authority, role, reached, days, now)
            write_private(key, private)
            certificate.write_bytes(pem)
        profile = folder / f"{role}.json5"
        if not profile.exists():
            profile.write_text(profile_of(role, folder, robots), encoding="utf-8")
        try:
            expires = expiry(certificate.read_bytes())
        except ValueError as error:
            raise CertificateError(f"{certificate} is no certificate: {error}") from error
        written.append(RoleFiles(role=role, profile=profile, expires=expires, new=new))
    return written


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
