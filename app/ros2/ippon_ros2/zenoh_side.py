"""The side of a bridge that faces the navigator: what it publishes there, and that it is alone."""

from __future__ import annotations

import logging
import os
import socket
import time
from collections.abc import Callable
from typing import Any

import zenoh
import zenoh.ext

from .settings import Ros2Error

logger = logging.getLogger(__name__)

MAX_KEPT = 100
"""Messages of transient local topics that are kept for a navigator that starts late."""
REFUSED_AFTER_S = 3.0
"""Time after which a declaration that has not come back counts as refused."""


def stream_publisher(session: zenoh.Session, key: str, *, kept: bool) -> Callable[[bytes], Any]:
    """Return what publishes the messages of a stream.

    Args:
        session: Connected to the navigator.
        key: Of the stream, with the robot's prefix.
        kept: Late subscribers get the last messages, too.
    """
    # An image that the network cannot carry in time is of no use: it is dropped.
    control = zenoh.CongestionControl.BLOCK if kept else zenoh.CongestionControl.DROP
    if kept:
        cache = zenoh.ext.CacheConfig(max_samples=MAX_KEPT)
        return zenoh.ext.declare_advanced_publisher(
            session, key, congestion_control=control, cache=cache, publisher_detection=True
        ).put
    return session.declare_publisher(key, congestion_control=control).put


def claim(session: zenoh.Session, robot: str, check: zenoh.Session | None = None) -> Any:
    """Declare this bridge; refuse where another one serves this robot.

    Args:
        session: Connected to the navigator.
        robot: Key prefix.
        check: A second session with the same certificate, through which this bridge looks for its
            own declaration: the router drops what its access rules refuse, and does not say so.

    Raises:
        Ros2Error: Another bridge was there first.
    """
    mine = f"{robot}/alive/ros2/{time.time_ns():020d}-{socket.gethostname()}-{os.getpid()}"
    token: Any = None
    # Clocks of two machines differ: times decide only between bridges that begin together.
    first = min(_bridges(session, robot), default=mine)
    if first == mine:
        token = session.liveliness().declare_token(mine)
        time.sleep(0.2)
        first = min([*_bridges(session, robot), mine])
    if first != mine:
        if token is not None:
            token.undeclare()
        host, pid = first.rsplit("/", 1)[-1].split("-", 1)[-1].rsplit("-", 1)
        raise Ros2Error(
            f"another bridge serves the robot {robot!r} already (process {pid} on {host}): end it, "
            "or give this robot another --robot"
        )
    if check is not None and not _is_shown(check, robot, mine):
        logger.warning(
            "the navigator's access rules refuse what this bridge sends: IPPON_ZENOH_PROFILE must "
            "name the profile of a robot (robot.json5 of `ippon certificates`, a certificate with "
            "the common name 'robot'), and the navigator's rules those of this version"
        )
    return token


def _is_shown(session: zenoh.Session, robot: str, key: str) -> bool:
    """Wait for a declaration to reach another session; return whether it does."""
    deadline = time.monotonic() + REFUSED_AFTER_S
    while key not in _bridges(session, robot):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.1)
    return True


def _bridges(session: zenoh.Session, robot: str) -> list[str]:
    """Return the declarations of all bridges of a robot."""
    replies = session.liveliness().get(f"{robot}/alive/ros2/*")
    return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]
