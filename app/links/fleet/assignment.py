"""Gives one search to the best of the robots that would take it."""

from dataclasses import dataclass, replace
from typing import Final

import msgspec
import zenoh

from app.links.fleet.bids import CredentialOf, RobotBid, ask_for_bids, in_order
from app.links.fleet.navigators import live_navigators
from app.links.network.requests import RequestRefusedError, ask
from app.links.network.session import LinkError
from app.messages import keys
from app.messages.control import SearchAccepted, SearchRequest

REPLY_S: Final = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Assignment:
    """Who got a search, and why the others did not."""

    given: RobotBid | None
    """None where nobody got it, or it is not known."""
    accepted: SearchAccepted | None
    """The robot's reply."""
    unsure: RobotBid | None
    """The robot that it was sent to and that did not confirm it; nobody else was asked, so that no
    two robots search for it."""
    others: tuple[RobotBid, ...]
    """The best first, then in alphabetical order; one that refused the search has that problem."""


def assign(
    session: zenoh.Session, search: SearchRequest, credential_of: CredentialOf
) -> Assignment:
    """Ask all robots on the router, and give the search to the best that takes it.

    A robot takes it only if it is still free (`SearchRequest.if_free`), because somebody else may
    have given it a goal since its bid: then the next one is tried.

    Args:
        session: An open session.
        search: What is searched for.
        credential_of: Who asks; never takes control from anybody.

    Raises:
        zenoh.ZError: The question could not be sent.
    """
    bids = ask_for_bids(session, live_navigators(session), search, credential_of)
    left = in_order(bids)
    rest = [one for one in bids if one not in left]
    late: list[RobotBid] = []
    request = msgspec.structs.replace(search, if_free=True)
    while left:
        best = left.pop(0)
        key, who = f"{best.name}/{keys.SEARCH}", credential_of(best.name)
        try:
            accepted = ask(session, key, request, SearchAccepted, REPLY_S, who)
        except RequestRefusedError as error:
            late.append(replace(best, problem="refused", detail=str(error)))
            continue
        except LinkError as error:
            unsure = replace(best, problem="silent", detail=str(error))
            others = (*left, *late, *rest)
            return Assignment(given=None, accepted=None, unsure=unsure, others=others)
        return Assignment(given=best, accepted=accepted, unsure=None, others=(*left, *late, *rest))
    return Assignment(given=None, accepted=None, unsure=None, others=(*late, *rest))
