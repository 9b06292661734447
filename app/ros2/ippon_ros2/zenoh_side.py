"""The side of a bridge that faces the navigator: what it publishes there, and that it is alone."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from typing import Any

import zenoh
import zenoh.ext

from .settings import Ros2Error

MAX_KEPT = 100
"""Messages of transient local topics that are kept for a navigator that starts late."""


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


def claim(session: zenoh.Session, robot: str) -> Any:
    """Declare this bridge; refuse where another one serves this robot.

    Raises:
        Ros2Error: Another bridge was there first.
    """
    mine = f"{robot}/alive/ros2/{time.time_ns():020d}-{socket.gethostname()}-{os.getpid()}"
    token = session.liveliness().declare_token(mine)
    time.sleep(0.2)
    found = [str(reply.ok.key_expr) for reply in session.liveliness().get(f"{robot}/alive/ros2/*")
             if reply.ok is not None]  # fmt: skip
    first = min([*found, mine])
    if first != mine:
        token.undeclare()
        host, pid = first.rsplit("/", 1)[-1].split("-", 1)[-1].rsplit("-", 1)
        raise Ros2Error(
            f"another bridge serves the robot {robot!r} already (process {pid} on {host}): end it, "
            "or give this robot another --robot"
        )
    return token
