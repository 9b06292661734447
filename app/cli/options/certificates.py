"""Options of `ippon certificates`."""

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificates:
    """Certificates for mutual TLS between all processes, with the access rules of each role.

    Makes a certificate authority and one certificate for each of navigator, robot, console,
    requester and recorder, and the zenoh profile of each. Run it again to add what is missing, or
    to renew what you deleted; what is there stays.

    `ippon certificates tls --hosts robot.local 192.168.1.20`, then
    `IPPON_ZENOH_PROFILE=tls/navigator.json5 ippon navigate --listen tls/0.0.0.0:7447`, and for each
    other process its own profile and `--connect tls/robot.local:7447`.
    """

    folder: tyro.conf.Positional[Path]
    """Where they lie. Copy to another machine ca.pem and the three files of one role, never
    ca.key; profiles name this folder, so it must have the same path there, or edit them."""
    hosts: tuple[str, ...] = ("localhost", "127.0.0.1")
    """Names and addresses under which the navigator's machine is reached; localhost and 127.0.0.1
    are always among them."""
    robot: tuple[str, ...] = ("ippon",)
    """Key prefixes of the robots that the access rules are about: of several robots on joined
    routers all, and in --hosts the machines of all their navigators."""
    days: int = 365
    """How long the certificates are valid; the authority is for ten years."""
