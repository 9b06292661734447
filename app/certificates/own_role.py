"""Whether this process has the certificate of the role that it plays.

A message that the navigator's access rules refuse is dropped without a word to its sender.
"""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import zenoh

from app.certificates.authority import common_name
from app.certificates.roles import NAVIGATOR, ROLES
from app.links.network.session import PROFILE

_CERTIFICATE: Final = "transport/link/tls/connect_certificate"


def role_mismatch(accepted: Sequence[str]) -> str:
    """Return what is wrong with this process's certificate; empty for nothing, or for none.

    A name that is no role of ours is not judged: the rules may be others.

    Args:
        accepted: Roles that may do what this process does, beside the navigator's.
    """
    profile = os.environ.get(PROFILE)
    name = own_name(Path(profile)) if profile else None
    if name is None or name not in ROLES or name in (NAVIGATOR, *accepted):
        return ""
    needed = " or ".join(map(repr, accepted))
    text = f"{PROFILE} names {profile}, a certificate of the role {name!r}; this needs {needed}"
    if NAVIGATOR in accepted:
        return text
    return (
        f"{text}: by the rules of `ippon certificates` the navigator drops what this process sends "
        "or asks for, and does not tell it"
    )


def own_name(profile: Path) -> str | None:
    """Return the common name of the certificate that a zenoh profile connects with.

    Returns:
        The name; None where there is no such certificate, or it cannot be read: opening the
        session says so.
    """
    try:
        certificate = json.loads(zenoh.Config.from_file(str(profile)).get_json(_CERTIFICATE))
        return common_name(Path(certificate).read_bytes()) if certificate else None
    except (zenoh.ZError, OSError, ValueError):
        return None
