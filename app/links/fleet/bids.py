"""Bids of all robots for one search, in order of preference."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final, Literal

import msgspec
import zenoh

from app.links.fleet.navigators import Question, ask_each
from app.messages import keys
from app.messages.control import Bid, BidRequest, ErrorReply, Ground, SearchRequest, decode, encode
from app.messages.lease import Credential
from app.messages.status import Status

BID_S: Final = 3.0
"""Time for a bid; the robots are asked at the same time."""

CredentialOf = Callable[[str], Credential | None]
"""Returns who asks a robot."""
Problem = Literal["", "silent", "unreadable", "old", "twice", "refused"]
"""Why there is no bid.

`silent`: its navigator did not answer in time; `unreadable`: its answer is no bid; `old`: it does
not serve the request, or the rules of the router do not let it through; `twice`: two navigators
have this name; `refused`: it answered with an error.
"""
_RANK: Final[dict[Ground, int]] = {"room": 0, "thing": 0, "area": 1, "unknown": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotBid:
    """The bid of one robot, or why there is none."""

    name: str
    bid: Bid | None = None
    problem: Problem = ""
    detail: str = ""
    """What is wrong; of `old` the version of the navigator, empty if it did not say."""


def ask_for_bids(
    session: zenoh.Session,
    names: Iterable[str],
    search: SearchRequest,
    credential_of: CredentialOf,
    timeout_s: float = BID_S,
) -> list[RobotBid]:
    """Return what each robot answers, in the order of the names."""
    payload = encode(BidRequest(search=search))
    questions: dict[str, Question] = {}
    for name in names:
        who = credential_of(name)
        attached = None if who is None else encode(who)
        questions[name] = Question(f"{name}/{keys.BID}", payload, attached)
    answers = ask_each(session, questions, timeout_s)
    found: list[RobotBid] = []
    for name, got in answers.items():
        if len(got.payloads) > 1:
            found.append(RobotBid(name=name, problem="twice"))
        elif got.payloads:
            found.append(_read(name, got.payloads[0][1]))
        else:
            found.append(RobotBid(name=name, problem="silent" if got.timed_out else "old"))
    return _with_versions(session, found, timeout_s)


def in_order(bids: Iterable[RobotBid]) -> list[RobotBid]:
    """Return the robots that would take the search, the best one first.

    Those that know the place come first, by the length of the way. Then come those that have
    explored some floor where no place was said, by how much. Of those that do not have the place in
    their map the one that has explored least comes first: a large map without that room makes it
    less likely that the room is there. Names decide between equals.
    """
    free = ((one, one.bid) for one in bids if one.bid is not None and one.bid.is_free)
    return [one for one, _ in sorted(free, key=lambda pair: _key(pair[0].name, pair[1]))]


def _key(name: str, bid: Bid) -> tuple[int, float, float, str]:
    way_m = math.inf if bid.way_m is None else bid.way_m
    sign = {"area": -1.0, "unknown": 1.0}.get(bid.ground, 0.0)
    return _RANK[bid.ground], way_m, sign * bid.explored_m2, name


def _read(name: str, payload: bytes) -> RobotBid:
    try:
        return RobotBid(name=name, bid=decode(payload, Bid))
    except msgspec.DecodeError as error:
        try:
            refused = decode(payload, ErrorReply)
        except msgspec.DecodeError:
            return RobotBid(name=name, problem="unreadable", detail=str(error)[:200])
        return RobotBid(name=name, problem="refused", detail=refused.error[:300])


def _with_versions(
    session: zenoh.Session, bids: list[RobotBid], timeout_s: float
) -> list[RobotBid]:
    """Ask those that do not serve the request which version they are."""
    old = {one.name: Question(f"{one.name}/{keys.STATUS}") for one in bids if one.problem == "old"}
    if not old:
        return bids
    versions: dict[str, str] = {}
    for name, got in ask_each(session, old, timeout_s).items():
        for _, payload in got.payloads[:1]:
            try:
                versions[name] = decode(payload, Status).version[:40]
            except msgspec.DecodeError:
                continue
    return [
        one if one.problem != "old" else RobotBid(
            name=one.name, problem="old", detail=versions.get(one.name, "")
        )
        for one in bids
    ]  # fmt: skip
