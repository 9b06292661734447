"""The control lease: one client holds it and renews it, the others watch.

free ──request──▶ held ──1 s of silence──▶ stale ──1 s more──▶ free, or the requester
                   │ release, grant, take                       ▲
                   └────────────────────────────────────────────┘
"""

from dataclasses import dataclass, replace
from typing import Final

from app.messages.lease import Credential, LeaseReply, LeaseStatus, sender_of

STALE_S: Final = 1.0
EXPIRY_S: Final = 2.0
"""Silence after which the holder loses the lease: four renewals."""
REQUEST_EXPIRY_S: Final = 10.0
"""Silence after which a request is dropped; longer than a lease, as a slow page may be alive."""


@dataclass(frozen=True, slots=True)
class _Party:
    session: str
    name: str
    heard_s: float


class Lease:
    """State machine of the lease. Times are seconds of a monotonic clock; not thread-safe."""

    def __init__(self) -> None:
        self._holder: _Party | None = None
        self._requester: _Party | None = None
        self._denied: tuple[str, str] | None = None
        self._epoch = 0
        self._events: list[str] = []

    def take_events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        events, self._events = tuple(self._events), []
        return events

    def status(self, now_s: float) -> LeaseStatus:
        """Return state, holder, requester and epoch."""
        self._expire(now_s)
        holder, requester = self._holder, self._requester
        if holder is None:
            return LeaseStatus(epoch=self._epoch)
        stale = now_s - holder.heard_s > STALE_S
        return LeaseStatus(
            state="stale" if stale else "held",
            holder=holder.name,
            requester=requester.name if requester is not None else "",
            epoch=self._epoch,
        )

    def request(self, who: Credential, now_s: float) -> LeaseReply:
        """Acquire the lease if it is free, otherwise request it from the holder."""
        self._expire(now_s)
        party = _Party(who.session, who.name, now_s)
        if self._holder is None:
            self._assign(party, f"{party.name} took control")
        elif self._is(self._holder, who):
            self._holder = replace(self._holder, heard_s=now_s)
        elif self._requester is None:
            self._requester = party
            self._denied = None
            self._events.append(f"{who.name} asks {self._holder.name} for control")
        elif self._is(self._requester, who):
            self._requester = replace(self._requester, heard_s=now_s)
        return self._reply(who)

    def renew(self, who: Credential, now_s: float) -> LeaseReply:
        """Keep a lease or a request alive."""
        self._expire(now_s)
        if self._holds(who):
            assert self._holder is not None
            self._holder = replace(self._holder, heard_s=now_s)
        elif self._is(self._requester, who):
            assert self._requester is not None
            self._requester = replace(self._requester, heard_s=now_s)
        return self._reply(who)

    def release(self, who: Credential, now_s: float) -> LeaseReply:
        """Give up a lease or a request."""
        self._expire(now_s)
        if self._holds(who):
            self._events.append(f"{who.name} released control")
            self._assign_next(now_s)
        elif self._is(self._requester, who):
            self._requester = None
            self._events.append(f"{who.name} no longer asks for control")
        return self._reply(who)

    def grant(self, who: Credential, now_s: float) -> LeaseReply:
        """Pass the lease from its holder to the requester."""
        self._expire(now_s)
        if self._holds(who) and self._requester is not None:
            self._assign(
                replace(self._requester, heard_s=now_s),
                f"{self._requester.name} was given control by {who.name}",
            )
        return self._reply(who)

    def deny(self, who: Credential, now_s: float) -> LeaseReply:
        """Refuse the requester; the holder keeps the lease."""
        self._expire(now_s)
        if self._holds(who) and self._requester is not None:
            self._denied = (self._requester.session, who.name)
            self._events.append(f"{who.name} keeps control; {self._requester.name} had asked")
            self._requester = None
        return self._reply(who)

    def take(self, who: Credential, now_s: float) -> LeaseReply:
        """Take the lease from its holder: for supervisors."""
        self._expire(now_s)
        if not self._is(self._holder, who):
            text = f"{who.name} took control"
            if self._holder is not None:
                text = f"{who.name} took control from {self._holder.name}"
            self._assign(_Party(who.session, who.name, now_s), text)
        return self._reply(who)

    def refusal(self, who: Credential | None, now_s: float) -> str | None:
        """Return why a command is refused, None when it is accepted.

        While the lease is free, everyone's commands are accepted.
        """
        self._expire(now_s)
        holder = self._holder
        if holder is None or (who is not None and self._holds(who)):
            return None
        if who is not None and self._is(holder, who):
            return "this lease has ended and a new one began; try again"
        return (
            f"{holder.name} has control: request it, wait until it is released, or take it "
            "(ippon ask --take)"
        )

    def answer_refusal(self, requester: str, now_s: float) -> str | None:
        """Return why a requester cannot be answered: it asks no more, or another one does."""
        self._expire(now_s)
        if self._requester is not None and self._requester.name == requester:
            return None
        return f"{requester} no longer asks for control"

    def teleop_refusal(self, sender: str, epoch: int, now_s: float) -> str | None:
        """Return why teleoperation is refused, None when accepted: it always needs the lease."""
        self._expire(now_s)
        if self._holder is None:
            return "nobody has control: take it to drive"
        if sender_of(self._holder.session) != sender:
            return f"{self._holder.name} has control"
        return None if epoch == self._epoch else "this lease has ended"

    def _holds(self, who: Credential) -> bool:
        return self._is(self._holder, who) and who.epoch == self._epoch

    @staticmethod
    def _is(party: _Party | None, who: Credential) -> bool:
        return party is not None and party.session == who.session

    def _assign(self, party: _Party, event: str) -> None:
        self._holder = party
        self._epoch += 1
        self._denied = None
        if self._requester is not None and self._requester.session == party.session:
            self._requester = None
        self._events.append(event)

    def _assign_next(self, now_s: float) -> None:
        successor, self._holder, self._requester = self._requester, None, None
        if successor is not None:
            # Requesters renew rarely, so the time of the last renewal is reset for the new holder.
            event = f"{successor.name} has control now"
            self._assign(replace(successor, heard_s=now_s), event)

    def _expire(self, now_s: float) -> None:
        requester, holder = self._requester, self._holder
        if requester is not None and now_s - requester.heard_s > REQUEST_EXPIRY_S:
            self._requester = None
        if holder is not None and now_s - holder.heard_s > EXPIRY_S:
            self._events.append(f"{holder.name} is gone: the lease expired")
            self._assign_next(now_s)

    def _reply(self, who: Credential) -> LeaseReply:
        holder = self._holder
        if self._is(holder, who):
            return LeaseReply(standing="holds", epoch=self._epoch, detail="You have control.")
        named = holder.name if holder is not None else "nobody"
        if self._is(self._requester, who):
            detail = f"You have asked {named} for control."
            return LeaseReply(standing="waits", epoch=self._epoch, detail=detail)
        if self._denied is not None and self._denied[0] == who.session:
            detail = f"{self._denied[1]} keeps control."
            return LeaseReply(standing="denied", epoch=self._epoch, detail=detail)
        if holder is None:
            detail = "Nobody has control."
        elif self._requester is not None:
            detail = f"{named} has control, and {self._requester.name} asks for it already."
        else:
            detail = f"{named} has control."
        return LeaseReply(standing="watches", epoch=self._epoch, detail=detail)
