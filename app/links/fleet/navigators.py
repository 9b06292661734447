"""The navigators on a router, and one question to each of them at the same time."""

import logging
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import zenoh

from app.messages import keys
from app.messages.keys import check_prefix

logger = logging.getLogger(__name__)

ANSWER_S: Final = 1.0
SETTLE_S: Final = 1.0
"""Time for routers to tell each other what a navigator serves; its token may come before."""
_AGAIN_S: Final = 0.05
MAX_ROBOTS: Final = 100
_SUFFIX: Final = f"/{keys.NAVIGATOR_ALIVE}"
_TIMED_OUT: Final = b"Timeout"
"""Error reply of zenoh at a timeout."""


class Question(NamedTuple):
    """What one navigator is asked."""

    key: str
    payload: bytes | None = None
    attachment: bytes | None = None


@dataclass(slots=True)
class Answers:
    """What came from one name: two answers are of two navigators with that name."""

    payloads: list[tuple[float, bytes]] = field(default_factory=list[tuple[float, bytes]])
    """Seconds from question to answer, and the answer."""
    timed_out: bool = False
    """Somebody serves the key and did not answer in time; without one, nobody serves it."""


def live_navigators(session: zenoh.Session) -> list[str]:
    """Return the names of the navigators on the router, in alphabetical order.

    Args:
        session: Has not watched a token before (`is_alive`): zenoh 1.x at times leaves out a token
            in a session whose subscription to it has ended.
    """
    names: set[str] = set()
    replies: Any = session.liveliness().get(f"**{_SUFFIX}", timeout=ANSWER_S)
    for reply in replies:
        if reply.ok is None:
            continue
        name = str(reply.ok.key_expr).removesuffix(_SUFFIX)
        try:
            check_prefix(name)
        except ValueError as error:
            logger.debug("a navigator is not listed: %s", error)
            continue
        names.add(name)
    return sorted(names)[:MAX_ROBOTS]


def ask_each(
    session: zenoh.Session, questions: Mapping[str, Question], timeout_s: float = ANSWER_S
) -> dict[str, Answers]:
    """Ask navigators at the same time; returns what came from each.

    Those that seem to serve nothing are asked again for `SETTLE_S`.
    """
    answers = _ask_once(session, questions, timeout_s)
    deadline = time.monotonic() + SETTLE_S
    while time.monotonic() < deadline:
        left = {n: questions[n] for n, a in answers.items() if not (a.payloads or a.timed_out)}
        if not left:
            break
        time.sleep(_AGAIN_S)
        answers |= _ask_once(session, left, timeout_s)
    return answers


def _ask_once(
    session: zenoh.Session, questions: Mapping[str, Question], timeout_s: float
) -> dict[str, Answers]:
    asked_s = time.monotonic()
    answers = {name: Answers() for name in questions}
    left = threading.Semaphore(0)
    for name, question in questions.items():

        def take(reply: zenoh.Reply, of: Answers = answers[name]) -> None:
            if reply.ok is not None:
                of.payloads.append((time.monotonic() - asked_s, reply.ok.payload.to_bytes()))
            elif reply.err is not None and reply.err.payload.to_bytes() == _TIMED_OUT:
                of.timed_out = True

        handler: Any = zenoh.handlers.Callback(take, drop=left.release, indirect=False)
        session.get(
            question.key,
            handler,
            payload=question.payload,
            attachment=question.attachment,
            # Every answer counts: two are two navigators of one name.
            consolidation=zenoh.ConsolidationMode.NONE,
            target=zenoh.QueryTarget.ALL,
            timeout=timeout_s,
        )
    for _ in questions:
        left.acquire(timeout=2.0 * timeout_s)
    return {
        name: Answers(list(got.payloads), timed_out=got.timed_out) for name, got in answers.items()
    }
