"""Requests for control of the robot, and the check of every command against the lease."""

import threading
import time
from collections.abc import Callable
from typing import Final

import msgspec

from app.links.network.requests import RequestRefusedError
from app.messages.control import is_stop
from app.messages.driving import TeleopTag
from app.messages.lease import Credential, LeaseReply, LeaseRequest, LeaseStatus, TakeRequest
from app.nodes.navigator.state.lease import Lease

Clock = Callable[[], float]

_NO_CREDENTIAL: Final = (
    "a request for control needs a credential attached: a JSON object with session (16 to 64 "
    "random letters and digits), name, and epoch"
)


class LeaseService:
    """Owns the lease; safe from any thread."""

    def __init__(self, clock: Clock = time.monotonic) -> None:
        self._lease = Lease()
        self._clock = clock
        self._lock = threading.Lock()
        self._shown = LeaseStatus()

    def ask(self, request: LeaseRequest, who: Credential | None) -> LeaseReply:
        """Answer a request for control.

        Raises:
            RequestRefusedError: It has no credential, or answers a requester who asks no more.
        """
        who = _required(who)
        lease = self._lease
        answers = request.action in {"grant", "deny"} and request.requester != ""
        act = {
            "request": lease.request,
            "renew": lease.renew,
            "release": lease.release,
            "grant": lease.grant,
            "deny": lease.deny,
        }[request.action]
        with self._lock:
            now = self._clock()
            problem = lease.answer_refusal(request.requester, now) if answers else None
            if problem is not None:
                raise RequestRefusedError(problem)
            return act(who, now)

    def take(self, _: TakeRequest, who: Credential | None) -> LeaseReply:
        """Take control from its holder."""
        who = _required(who)
        with self._lock:
            return self._lease.take(who, self._clock())

    def authorize(self, message: msgspec.Struct, who: Credential | None) -> None:
        """Accept a command of the lease's holder, and Stop of anybody.

        Raises:
            RequestRefusedError: Somebody else has control.
        """
        if is_stop(message):
            return
        with self._lock:
            problem = self._lease.refusal(who, self._clock())
        if problem is not None:
            raise RequestRefusedError(problem)

    def teleop_refusal(self, tag: TeleopTag) -> str | None:
        """Return why a teleoperation message is refused, None when it is accepted."""
        with self._lock:
            return self._lease.teleop_refusal(tag.sender, tag.epoch, self._clock())

    def holder_besides(self, who: Credential | None) -> str:
        """Return the name of who has control; empty for nobody, and for who asks."""
        with self._lock:
            now = self._clock()
            is_free = self._lease.refusal(who, now) is None
            return "" if is_free else self._lease.status(now).holder

    def status(self) -> LeaseStatus:
        """Return the holder and the requester of control."""
        with self._lock:
            return self._lease.status(self._clock())

    def watch(self) -> tuple[tuple[str, ...], bool, bool]:
        """Return the changes since the last call.

        Returns:
            One line for each event; whether the status changed; whether the former holder lost
            control.
        """
        with self._lock:
            status = self._lease.status(self._clock())
            events = self._lease.take_events()
        before, self._shown = self._shown, status
        lost = before.state != "free" and (status.epoch != before.epoch or status.state == "free")
        return events, status != before, lost


def _required(who: Credential | None) -> Credential:
    if who is None:
        raise RequestRefusedError(_NO_CREDENTIAL)
    return who
