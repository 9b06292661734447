"""Subscriptions that keep the order of one sender's messages over all its keys."""

import threading
from collections.abc import Callable
from typing import Any

import zenoh
import zenoh.ext


def subscribe(
    session: zenoh.Session, key: str, take: Callable[[bytes], None], *, kept: bool = False
) -> Callable[[], None]:
    """Pass every message of a key to `take` while the session is open; return what ends that.

    By default, zenoh's Python binding gives each subscription its own thread, and messages of two
    keys can overtake one another. A command is a tilt and a twist, and a frame is five messages:
    their order matters.

    Args:
        session: An open session.
        key: Key, wildcards included.
        take: Called in zenoh's network thread: it must return at once and not use the session.
        kept: Also request messages from before the subscription (ROS 2's transient local), which a
            bridge sends once, such as `tf_static`.
    """

    def receive(sample: zenoh.Sample) -> None:
        take(sample.payload.to_bytes())

    handler: Any = zenoh.handlers.Callback(receive, indirect=False)
    if kept:
        history = zenoh.ext.HistoryConfig(detect_late_publishers=True)
        subscriber: Any = zenoh.ext.declare_advanced_subscriber(
            session, key, handler, history=history
        )
    else:
        subscriber = session.declare_subscriber(key, handler)

    def end() -> None:
        subscriber.undeclare()

    return end


def is_alive(session: zenoh.Session, token: str, timeout_s: float) -> bool:
    """Wait for a liveliness token; return whether it appeared in time."""
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


def on_token(
    session: zenoh.Session,
    token: str,
    *,
    seen: Callable[[], None] | None = None,
    lost: Callable[[], None] | None = None,
) -> None:
    """Call when a liveliness token appears or disappears, also by a connection that breaks.

    A connection that is silent for `session.LEASE_MS` is closed, and zenoh opens it again:
    subscriptions continue, and the messages in between are lost.

    Args:
        session: An open session.
        token: Key of the token.
        seen: Called for a token that is there, and whenever it appears again.
        lost: Called whenever a token that was seen disappears.

    Both are called in zenoh's network thread: they must return at once and not use the session.
    """

    def receive(sample: zenoh.Sample) -> None:
        take = lost if sample.kind == zenoh.SampleKind.DELETE else seen
        if take is not None:
            take()

    handler: Any = zenoh.handlers.Callback(receive, indirect=False)
    # Without history, the end of a token that was declared before would not be reported.
    session.liveliness().declare_subscriber(token, handler, history=True)
