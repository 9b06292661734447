"""One holds control, others watch: a lease that its holder renews, or loses.

free ──request──▶ held ──1 s of silence──▶ stale ──1 s more──▶ free, or whoever asked
                   │ release, grant, take                       ▲
                   └────────────────────────────────────────────┘
"""

from dataclasses import dataclass, replace
from typing import Final

from app.messages.lease import Credential, LeaseReply, LeaseStatus

STALE_S: Final = 1.0
EXPIRY_S: Final = 2.0
"""A holder who is silent for so long holds no more: four renewals."""
PATIENCE_S: Final = 10.0
"""A request whose page is silent for so long is forgotten: a slow page may still be there."""


@dataclass(frozen=True, slots=True)
class _Party:
    session: str
    name: str
    heard_s: float


class Lease:
    """Time is an argument, seconds of any steady clock; not safe from several threads."""

    def __init__(self) -> None:
        self._holder: _Party | None = None
        self._requester: _Party | None = None
        self._denied: tuple[str, str] | None = None
        self._epoch = 0
        self._news: list[str] = []

    def take_news(self) -> tuple[str, ...]:
        """Return what has happened since the last call, one line each."""
        news, self._news = tuple(self._news), []
        return news

    def status(self, now_s: float) -> LeaseStatus:
        """Return who holds control."""
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
        """Take control where it is free; else ask its holder."""
        self._expire(now_s)
        party = _Party(who.session, who.name, now_s)
        if self._holder is None:
            self._hand_to(party, "took control")
        elif self._is(self._holder, who):
            self._holder = replace(self._holder, heard_s=now_s)
        elif self._requester is None:
            self._requester = party
            self._denied = None
            self._news.append(f"{who.name} asks {self._holder.name} for control")
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
            self._news.append(f"{who.name} released control")
            self._pass_on(now_s)
        elif self._is(self._requester, who):
            self._requester = None
            self._news.append(f"{who.name} asks for control no more")
        return self._reply(who)

    def grant(self, who: Credential, now_s: float) -> LeaseReply:
        """Hand control to whoever asks for it."""
        self._expire(now_s)
        if self._holds(who) and self._requester is not None:
            self._hand_to(
                replace(self._requester, heard_s=now_s), f"was given control by {who.name}"
            )
        return self._reply(who)

    def deny(self, who: Credential, now_s: float) -> LeaseReply:
        """Keep control although somebody asks for it."""
        self._expire(now_s)
        if self._holds(who) and self._requester is not None:
            self._denied = (self._requester.session, who.name)
            self._news.append(f"{who.name} keeps control; {self._requester.name} had asked")
            self._requester = None
        return self._reply(who)

    def take(self, who: Credential, now_s: float) -> LeaseReply:
        """Take control from whoever has it: for supervisors."""
        self._expire(now_s)
        if not self._is(self._holder, who):
            whose = f" from {self._holder.name}" if self._holder is not None else ""
            self._hand_to(_Party(who.session, who.name, now_s), f"took control{whose}")
        return self._reply(who)

    def refusal(self, who: Credential | None, now_s: float) -> str | None:
        """Return why a command must not count, None when it does.

        While nobody holds control a command is its own lease: it counts, whoever it is from.
        """
        self._expire(now_s)
        holder = self._holder
        if holder is None or (who is not None and self._holds(who)):
            return None
        if who is not None and self._is(holder, who):
            return "this control has ended and began anew since; try again"
        return (
            f"{holder.name} holds control: ask for it, wait until it is released, or take it over "
            "(ippon ask --take)"
        )

    def refusal_of_hand(self, session: str, epoch: int, now_s: float) -> str | None:
        """Return why a hand on the wheels must not count: driving needs the lease, always."""
        self._expire(now_s)
        if self._holder is None:
            return "nobody holds control: take it to drive"
        if self._holder.session != session:
            return f"{self._holder.name} holds control"
        return None if epoch == self._epoch else "this control has ended"

    def _holds(self, who: Credential) -> bool:
        return self._is(self._holder, who) and who.epoch == self._epoch

    @staticmethod
    def _is(party: _Party | None, who: Credential) -> bool:
        return party is not None and party.session == who.session

    def _hand_to(self, party: _Party, how: str) -> None:
        self._holder = party
        self._epoch += 1
        self._denied = None
        if self._requester is not None and self._requester.session == party.session:
            self._requester = None
        self._news.append(f"{party.name} {how}")

    def _pass_on(self, now_s: float) -> None:
        heir, self._holder, self._requester = self._requester, None, None
        if heir is not None:
            # Who waits speaks seldom; from now on silence counts as a holder's.
            self._hand_to(replace(heir, heard_s=now_s), "has control now")

    def _expire(self, now_s: float) -> None:
        requester, holder = self._requester, self._holder
        if requester is not None and now_s - requester.heard_s > PATIENCE_S:
            self._requester = None
        if holder is not None and now_s - holder.heard_s > EXPIRY_S:
            self._news.append(f"{holder.name} is gone: control ran out")
            self._pass_on(now_s)

    def _reply(self, who: Credential) -> LeaseReply:
        holder = self._holder
        if self._is(holder, who):
            return LeaseReply(standing="holds", epoch=self._epoch, detail="You hold control.")
        named = holder.name if holder is not None else "nobody"
        if self._is(self._requester, who):
            detail = f"You have asked {named} for control."
            return LeaseReply(standing="waits", epoch=self._epoch, detail=detail)
        if self._denied is not None and self._denied[0] == who.session:
            detail = f"{self._denied[1]} keeps control."
            return LeaseReply(standing="denied", epoch=self._epoch, detail=detail)
        if holder is None:
            detail = "Nobody holds control."
        elif self._requester is not None:
            detail = f"{named} holds control, and {self._requester.name} asks for it already."
        else:
            detail = f"{named} holds control."
        return LeaseReply(standing="watches", epoch=self._epoch, detail=detail)
