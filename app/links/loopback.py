"""Addresses of this machine."""

import ipaddress
import re
from typing import Final

HOSTS: Final = ("localhost", "127.0.0.1")
_EVERY_ADDRESS: Final = re.compile(r"(?<=/)(0\.0\.0\.0|\[::\])(?=:)")


def is_loopback(host: str) -> bool:
    """Return whether a host name or numeric address is this machine's own."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def reachable(listen: str) -> str:
    """Return where a process of this machine reaches an endpoint that is listened on.

    That of every address names none, and no certificate is for it.
    """
    return _EVERY_ADDRESS.sub("127.0.0.1", listen, count=1)
