"""zenoh sessions: explicit endpoints, no multicast, a dead peer noticed within a second."""

import json
import os
import re
from typing import Any, Final

import zenoh

from app.links.loopback import is_loopback

LEASE_MS: Final = 1000
"""Silence after which a peer counts as gone."""
PROFILE: Final = "IPPON_ZENOH_PROFILE"
"""Environment variable: a zenoh configuration file (JSON5) for TLS and access control. Endpoints
and time-outs are set by this program."""
ROBOT_PROFILE: Final = "IPPON_ZENOH_ROBOT_PROFILE"
"""The same for the connection to the router of a robot's own nodes."""
_PROTECTIONS: Final = (
    "access_control/enabled",
    "transport/auth/usrpwd/dictionary_file",
    "transport/auth/pubkey/known_keys_file",
)
"""Settings of a router that say who may connect, or what they may do."""


class LinkError(Exception):
    """No connection; the text says what was tried and what would work."""


_ENDPOINT: Final = re.compile(r"(tcp|tls|quic|udp|ws|unixsock-stream)/\S+")


def check_endpoint(endpoint: str) -> None:
    """Refuse an invalid zenoh endpoint.

    Raises:
        LinkError: The endpoint is invalid; the text shows a valid one.
    """
    if _ENDPOINT.fullmatch(endpoint) is None:
        raise LinkError(
            f"{endpoint!r} is not a zenoh endpoint, such as tcp/127.0.0.1:7447 or "
            "tls/robot.local:7447"
        )


def check_client(connect: str) -> None:
    """Refuse what no waiting mends: an invalid endpoint, or configuration in `PROFILE`.

    Raises:
        LinkError: One of them is invalid; the text says what would work.
    """
    check_endpoint(connect)
    _profile(PROFILE)


def is_open_to_all(listen: str) -> bool:
    """Return whether all programs of other machines reach an endpoint, and may do everything.

    Raises:
        LinkError: The profile of this process cannot be read.
    """
    protocol, _, address = listen.partition("/")
    host = address.partition("?")[0].partition("#")[0].rpartition(":")[0].strip("[]")
    if protocol == "unixsock-stream" or is_loopback(host):
        return False
    settings = _profile(PROFILE)
    if any(json.loads(settings.get_json(key)) for key in _PROTECTIONS):
        return False
    asks_certificate = json.loads(settings.get_json("transport/link/tls/enable_mtls"))
    by_endpoint = "enable_mtls=true" in address
    return protocol not in ("tls", "quic") or not (asks_certificate or by_endpoint)


def open_router(listen: str) -> zenoh.Session:
    """Open a session that others connect to.

    Args:
        listen: Endpoint, for example `tcp/127.0.0.1:7447`.

    Raises:
        LinkError: The endpoint cannot be listened on.
    """
    check_endpoint(listen)
    settings = {"mode": "router", "listen/endpoints": [listen], "listen/exit_on_failure": True}
    try:
        return zenoh.open(_config(settings))
    except zenoh.ZError as error:
        raise LinkError(
            f"cannot listen on {listen}: another navigator may be running there; choose another "
            f"endpoint ({error})"
        ) from error


def open_client(
    connect: str, timeout_s: float = 5.0, *, peer: str = "navigator", profile: str = PROFILE
) -> zenoh.Session:
    """Open a session to a router.

    Args:
        connect: Endpoint of the router, for example `tcp/127.0.0.1:7447`.
        timeout_s: How long to try.
        peer: Whose router it is, for messages.
        profile: Environment variable that names the zenoh configuration.

    Raises:
        LinkError: No router answers there.
    """
    check_endpoint(connect)
    settings = {
        "mode": "client",
        "connect/endpoints": [connect],
        "connect/timeout_ms": round(1e3 * timeout_s),
        "connect/exit_on_failure": True,
        # Messages for late joiners are identified by their timestamps.
        "timestamping/enabled": True,
    }
    try:
        return zenoh.open(_config(settings, profile))
    except zenoh.ZError as error:
        raise LinkError(
            f"no {peer} answers at {connect} within {timeout_s:g} s: is it running, and is the "
            "endpoint right? A refused TLS certificate looks the same"
        ) from error


def open_robot_client(router: str, timeout_s: float) -> zenoh.Session:
    """Open a session to the router of a robot's own ROS 2 nodes; raises LinkError."""
    return open_client(router, timeout_s, peer="router of the robot", profile=ROBOT_PROFILE)


def _config(settings: dict[str, Any], variable: str = PROFILE) -> zenoh.Config:
    config = _profile(variable)
    always = {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        # Without scouting no peer is awaited; the default delays every router by 500 ms.
        "scouting/delay": 0,
        "transport/link/tx/lease": LEASE_MS,
    }
    for key, value in {**always, **settings}.items():
        config.insert_json5(key, json.dumps(value))
    return config


def _profile(variable: str) -> zenoh.Config:
    path = os.environ.get(variable)
    if not path:
        return zenoh.Config()
    try:
        return zenoh.Config.from_file(path)
    except zenoh.ZError as error:
        raise LinkError(
            f"{variable} names {path!r}, which is not a zenoh configuration ({error}); "
            "see docs/guides/security.md for examples"
        ) from error
