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
    requests = _Requests(session, robot, receivers)
    # Not at its end: a link may break before a token is seen through it.
    on_token(session, f"{robot}/{keys.NAVIGATOR_ALIVE}", seen=requests.begin)
    return requests.begin


class _Requests:
    """Requests of one session, one after the other."""

    def __init__(
        self, session: zenoh.Session, robot: str, receivers: Mapping[str, LatchedReceiver]
    ) -> None:
        self._session, self._robot, self._receivers = session, robot, receivers
        self._lock = threading.Lock()
        self._runs = self._again = False

    def begin(self) -> None:
        """Request all of them, in a thread; while one runs, once more after it."""
        with self._lock:
            self._again = True
            if self._runs:
                return
            self._runs = True
        threading.Thread(target=self._run, name="last messages", daemon=True).start()

    def _run(self) -> None:
        while True:
            with self._lock:
                if not self._again or self._session.is_closed():
                    self._runs = False
                    return
                self._again = False
            try:
                self._request_until_answered()
            except zenoh.ZError as error:
                logger.debug("last messages: %s", error)

    def _request_until_answered(self) -> None:
        """Request all of them until one is answered, since a start takes a while, then the late.

        A reply that did not come in the whole time is late or lost; nobody serves a topic whose
        request ends at once.
        """
        wanted, is_heard = dict(self._receivers), False
        while wanted and not self._again and not self._session.is_closed():
            late: dict[str, LatchedReceiver] = {}
            for topic, receiver in wanted.items():
                asked_at = time.monotonic()
                if receiver.request(partial(self._last, topic)):
                    is_heard = True
                elif time.monotonic() - asked_at >= _REPLY_S:
                    late[topic] = receiver
            if is_heard:
                wanted = late
            if wanted:
                time.sleep(_AGAIN_S)

    def _last(self, topic: str) -> bytes | None:
        return last_message(self._session, f"{self._robot}/{topic}", _REPLY_S)
