"""Addresses of this machine."""

import ipaddress


def is_loopback(host: str) -> bool:
    """Return whether a host name or numeric address is this machine's own."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
