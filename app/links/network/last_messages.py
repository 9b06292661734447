"""Requests the last messages of latched topics at a start, and after each break of the link."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

import zenoh

from app.links.network.latched_topic import LatchedReceiver
from app.links.network.requests import last_message
from app.links.network.subscription import on_token_lost
from app.messages import keys

logger = logging.getLogger(__name__)

_REPLY_S: Final = 2.0
_AGAIN_S: Final = 0.5


def request_after_breaks(
    session: zenoh.Session, robot: str, receivers: Mapping[str, LatchedReceiver]
) -> Callable[[], None]:
    """Request what the navigator published while the link to it was broken.

    Args:
        session: An open session; the requests end with it.
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

    on_token_lost(session, f"{robot}/{keys.NAVIGATOR_ALIVE}", request)
    return request


def _request_until_answered(
    session: zenoh.Session, robot: str, receivers: Mapping[str, LatchedReceiver]
) -> None:
    """Request all of them again until one is answered: a broken link or a start takes a while."""

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
