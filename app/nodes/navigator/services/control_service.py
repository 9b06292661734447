"""The lease on the network: requests for control in, permission for everything else out."""

import threading
import time
from collections.abc import Callable
from typing import Final

import msgspec
import zenoh

from app.links.network.requests import RequestRefusedError, serve_with_credential
from app.messages import keys
from app.messages.control import ControlRequest
from app.messages.driving import TeleopTag
from app.messages.lease import Credential, LeaseReply, LeaseRequest, LeaseStatus, TakeRequest
from app.nodes.navigator.state.lease import Lease

Clock = Callable[[], float]

_NAMELESS: Final = (
    "control is asked for with a credential attached: a JSON object with session (16 to 64 "
    "letters and digits, drawn at random), name, and epoch"
)


class ControlService:
    """Keeps the lease; safe from any thread."""

    def __init__(self, session: zenoh.Session, robot: str, clock: Clock = time.monotonic) -> None:
        self._lease = Lease()
        self._clock = clock
        self._lock = threading.Lock()
        self._shown = LeaseStatus()
        self._queryables = [
            serve_with_credential(session, f"{robot}/{keys.LEASE}", LeaseRequest, self.ask),
            serve_with_credential(session, f"{robot}/{keys.LEASE_TAKE}", TakeRequest, self.take),
        ]

    def ask(self, request: LeaseRequest, who: Credential | None) -> LeaseReply:
        """Answer a request for control."""
        who = _known(who)
        lease = self._lease
        act = {
            "request": lease.request,
            "renew": lease.renew,
            "release": lease.release,
            "grant": lease.grant,
            "deny": lease.deny,
        }[request.action]
        with self._lock:
            return act(who, self._clock())

    def take(self, _: TakeRequest, who: Credential | None) -> LeaseReply:
        """Take control from its holder."""
        who = _known(who)
        with self._lock:
            return self._lease.take(who, self._clock())

    def authorize(self, message: msgspec.Struct, who: Credential | None) -> None:
        """Let a command pass; Stop is everyone's, always.

        Raises:
            RequestRefusedError: Somebody else holds control.
        """
        if isinstance(message, ControlRequest) and message.action == "stop":
            return
        with self._lock:
            problem = self._lease.refusal(who, self._clock())
        if problem is not None:
            raise RequestRefusedError(problem)

    def refuse_hand(self, tag: TeleopTag) -> str | None:
        """Return why a hand on the wheels must not count, None when it does."""
        with self._lock:
            return self._lease.refusal_of_hand(tag.sender, tag.epoch, self._clock())

    def status(self) -> LeaseStatus:
        """Return who holds control."""
        with self._lock:
            return self._lease.status(self._clock())

    def watch(self) -> tuple[tuple[str, ...], bool, bool]:
        """Take note of what has changed since the last call.

        Returns:
            What happened, one line each; whether the status has changed; whether whoever held
            control does no more.
        """
        with self._lock:
            status = self._lease.status(self._clock())
            news = self._lease.take_news()
        before, self._shown = self._shown, status
        lost = before.state != "free" and (status.epoch != before.epoch or status.state == "free")
        return news, status != before, lost


def _known(who: Credential | None) -> Credential:
    if who is None:
        raise RequestRefusedError(_NAMELESS)
    return who
