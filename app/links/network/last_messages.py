"""Requests the last messages of latched topics when the navigator appears, and after each break."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

import zenoh

from app.links.network.latched_topic import LatchedReceiver
from app.links.network.requests import last_message
from app.links.network.subscription import on_token
from app.messages import keys

logger = logging.getLogger(__name__)

_REPLY_S: Final = 2.0
_AGAIN_S: Final = 0.5


def request_when_seen(
    session: zenoh.Session, robot: str, receivers: Mapping[str, LatchedReceiver]
) -> Callable[[], None]:
    """Request what the navigator published before it was seen, or while its link was broken.

    Args:
        session: An open session, which subscribes to the topics already; the requests end with it.
        robot: Key prefix.
        receivers: By topic; they take the replies in a thread of this module.

    Returns:
        Requests the last messages now as well, and returns at once.
    """

    def request() -> None:
        threading.Thread(
            target=_request_until_answered,
            args=(session, robot, receivers),
            name="last messages",
            daemon=True,
        ).start()

    # Not at its end: a link may break before a token is seen through it.
    on_token(session, f"{robot}/{keys.NAVIGATOR_ALIVE}", seen=request)
    return request


def _request_until_answered(
    session: zenoh.Session, robot: str, receivers: Mapping[str, LatchedReceiver]
) -> None:
    """Request all of them again until one is answered: a start takes a while."""

    def last(topic: str) -> bytes | None:
        return last_message(session, f"{robot}/{topic}", _REPLY_S)

    try:
        while not session.is_closed():
            came = [receiver.request(partial(last, topic)) for topic, receiver in receivers.items()]
            if any(came):
                return
            time.sleep(_AGAIN_S)
    except zenoh.ZError as error:
        logger.debug("last messages: %s", error)
