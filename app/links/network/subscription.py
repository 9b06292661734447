"""Subscriptions that keep the order in which one sender spoke, over all its keys."""

import threading
from collections.abc import Callable
from typing import Any

import zenoh
import zenoh.ext


def subscribe(
    session: zenoh.Session, key: str, take: Callable[[bytes], None], *, kept: bool = False
) -> None:
    """Hand every message of a key to `take`, for as long as the session is open.

    zenoh's Python binding gives each subscription a thread of its own by default, so that messages
    of two keys overtake one another: of 2000 sent in turn, up to 240 did. A command is a tilt and
    a twist and a frame is five messages, so their order matters.

    Args:
        session: An open session.
        key: Key, wildcards included.
        take: Called in zenoh's network thread: it must return at once and not use the session.
        kept: Ask publishers, too, for what they keep for those who come late: what ROS 2 calls
            transient local, and a bridge sends once, such as `tf_static`.
    """

    def receive(sample: zenoh.Sample) -> None:
        take(sample.payload.to_bytes())

    handler: Any = zenoh.handlers.Callback(receive, indirect=False)
    if kept:
        history = zenoh.ext.HistoryConfig(detect_late_publishers=True)
        zenoh.ext.declare_advanced_subscriber(session, key, handler, history=history)
    else:
        session.declare_subscriber(key, handler)


def is_alive(session: zenoh.Session, token: str, timeout_s: float) -> bool:
    """Wait until somebody declares a liveliness token; tell whether it is there in time."""
    there = threading.Event()

    def receive(sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.PUT:
            there.set()

    handler: Any = zenoh.handlers.Callback(receive, indirect=False)
    subscriber = session.liveliness().declare_subscriber(token, handler, history=True)
    try:
        return there.wait(timeout_s)
    finally:
        subscriber.undeclare()  # pyright: ignore[reportUnknownMemberType]


def on_token_lost(session: zenoh.Session, token: str, take: Callable[[], None]) -> None:
    """Tell whenever who declared a liveliness token is gone, or the line to it broke.

    A line that is silent for a second is given up (`session.LEASE_MS`), and zenoh opens it again by
    itself: subscriptions go on as if nothing had been, and what was said meanwhile is lost.

    Args:
        session: An open session.
        token: Key of the token.
        take: Called in zenoh's network thread: it must return at once and not use the session.
    """

    def receive(sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            take()

    handler: Any = zenoh.handlers.Callback(receive, indirect=False)
    # Of a token that was there before, and not asked for, its end would not be told.
    session.liveliness().declare_subscriber(token, handler, history=True)
