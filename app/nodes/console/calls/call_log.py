"""The calls of this console: at most one of a kind in a minute, with what became of each."""

import logging
import threading
from collections import deque
from collections.abc import Callable, Collection, Iterable
from typing import Final

import msgspec

from app.messages.status import Status, goal_of, name_of
from app.nodes.console.calls.call import KINDS, Call, CallKind, Occasion, Verdict
from app.view.words import ENGLISH, Words

logger = logging.getLogger(__name__)

EVERY_S: Final = 60.0
"""Least time between two calls of one kind; what comes up in between is counted."""
KEPT: Final = 40
_STATES: Final[frozenset[CallKind]] = frozenset({"contact", "lost", "stuck", "disk"})
"""Kinds that need nobody any more once they are over."""


class CallsShown(msgspec.Struct, frozen=True, kw_only=True):
    """What a page knows of the calls."""

    calls: list[Call]
    """The latest first."""
    titles: dict[CallKind, str]
    webhook: str
    """Where calls are sent; empty without a webhook."""


class CallLog:
    """Numbers, limits and keeps the calls; one thread steps it, any thread may read and note."""

    def __init__(self, say: Words = ENGLISH) -> None:
        self._words = say
        self._titles: dict[CallKind, str] = {kind: say(f"call.{kind}") for kind in KINDS}
        self._send: Callable[[Call], None] | None = None
        self._webhook = ""
        self._lock = threading.Lock()
        self._calls: deque[Call] = deque(maxlen=KEPT)
        self._number = 0
        self._called_s: dict[CallKind, float] = {}
        self._held: dict[CallKind, list[Occasion]] = {}
        """Occasions of each kind since its last call, without finds that were judged."""

    def send_to(self, send: Callable[[Call], None], webhook: str) -> None:
        """Send calls to a webhook from now on.

        Args:
            send: Sends a call without waiting.
            webhook: Where it is sent, as people may read it.
        """
        self._send, self._webhook = send, webhook

    def step(
        self,
        occasions: Iterable[Occasion],
        now_s: float,
        wall_ns: int,
        holding: Collection[CallKind] = KINDS,
    ) -> None:
        """Call for occasions, and for those held back whose time has come.

        Args:
            occasions: What has come up.
            now_s: Monotonic time.
            wall_ns: Nanoseconds since 1970.
            holding: Kinds of what holds now; a state that is over is only counted.
        """
        for one in occasions:
            self._held.setdefault(one.kind, []).append(one)
        for kind, held in list(self._held.items()):
            if kind in _STATES and kind not in holding:
                continue
            last_s = self._called_s.get(kind)
            if last_s is None or now_s - last_s >= EVERY_S:
                del self._held[kind]
                self._called_s[kind] = now_s
                self._call(held[-1], len(held), wall_ns)

    def follow(self, status: Status) -> None:
        """Note the verdicts on finds that were called for, and the goals that are no longer known.

        Of a judged find nobody needs to hear. A navigator that was started again counts its goals
        from 1: what can be repeated is only a goal of the same name.
        """
        for kind, held in list(self._held.items()):
            self._held[kind] = [one for one in held if not verdict_on(one, status)]
            if not self._held[kind]:
                del self._held[kind]
        with self._lock:
            for place, call in enumerate(self._calls):
                if not call.judged and (judged := verdict_on(call.occasion, status)):
                    self._calls[place] = msgspec.structs.replace(call, judged=judged)
                if not _is_known(call.occasion, status):
                    gone = msgspec.structs.replace(call.occasion, goal_id=None)
                    self._calls[place] = msgspec.structs.replace(self._calls[place], occasion=gone)

    def note(self, number: int, webhook: str) -> None:
        """Note what became of a call at the webhook."""
        with self._lock:
            for place, call in enumerate(self._calls):
                if call.number == number:
                    self._calls[place] = msgspec.structs.replace(call, webhook=webhook)

    def shown(self) -> CallsShown:
        """Return what a page shows."""
        with self._lock:
            calls = list(self._calls)[::-1]
        return CallsShown(calls=calls, titles=self._titles, webhook=self._webhook)

    def _call(self, one: Occasion, count: int, wall_ns: int) -> None:
        self._number += 1
        call = Call(
            number=self._number,
            title=self._titles[one.kind],
            occasion=one,
            wall_ns=wall_ns,
            count=count,
            webhook=self._words("call.sending") if self._send is not None else "",
        )
        logger.info("call %d: %s: %s", call.number, call.title, one.text)
        with self._lock:
            self._calls.append(call)
        if self._send is not None:
            self._send(call)


def _is_known(one: Occasion, status: Status) -> bool:
    """Return whether an occasion is about no goal, or about one that the navigator knows."""
    if one.goal_id is None:
        return True
    goal = goal_of(status, one.goal_id)
    return goal is not None and name_of(goal) == one.object


def verdict_on(one: Occasion, status: Status) -> Verdict:
    """Return what the operator said of a find; empty if nothing, and of another occasion."""
    if one.goal_id is None or not one.find:
        return ""
    goal = goal_of(status, one.goal_id)
    if goal is None or name_of(goal) != one.object:
        return ""
    if goal.count != 1:
        confirmed = {counted.number: counted.confirmed for counted in goal.counted}
        confirmed |= {goal.find: goal.confirmed} if goal.find else {}
        if one.find in confirmed:
            return "confirmed" if confirmed[one.find] else ""
        if goal.find is None and goal.outcome in ("found", "out_of_reach"):
            # A navigator of an earlier version does not say which find was the last.
            return ""
        return "rejected" if goal.rejected else ""
    # The finds of a goal are numbered as they come.
    if one.find <= goal.rejected:
        return "rejected"
    return "confirmed" if goal.confirmed else ""
