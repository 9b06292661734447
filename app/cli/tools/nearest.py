"""`ippon ask --nearest`: the search goes to the nearest free robot of a router."""

import sys

import msgspec
import zenoh

from app.cli.options.tools import Ask
from app.cli.tools.levels_table import printable
from app.errors import UsageError
from app.links.fleet.assignment import Assignment, assign
from app.links.fleet.navigators import live_navigators
from app.messages.control import SearchAccepted, SearchRequest
from app.view.bid_wording import place_of, why_not
from app.view.words import ENGLISH


def check_options(command: Ask) -> None:
    """Refuse options that do not go with --nearest.

    Raises:
        UsageError: There is one.
    """
    if command.take:
        raise UsageError("--nearest takes control from nobody: leave out --take")
    for name, given in (("--explain", command.explain), ("--add-label", command.add_label)):
        if given:
            raise UsageError(f"{name} is about one robot: leave out --nearest")


def reader(session: zenoh.Session, preferred: str) -> str:
    """Return the robot that reads the sentence: the preferred one if it is there.

    Raises:
        UsageError: No navigator is on the router.
    """
    names = live_navigators(session)
    if not names:
        raise UsageError("no navigator is on the router: nobody got the goal")
    return preferred if preferred in names else names[0]


def give(
    session: zenoh.Session, searches: list[SearchRequest], command: Ask
) -> tuple[str, SearchAccepted] | None:
    """Give a search to the nearest free robot, and print who got it and why not the others.

    Returns:
        The robot and its reply; None where nobody got it.

    Raises:
        UsageError: Several objects are named.
    """
    if len(searches) > 1:
        raise UsageError(f"{len(searches)} objects are named: give one at a time with --nearest")
    search = searches[0]
    result = assign(session, search, lambda _: None)
    if command.json:
        print(msgspec.json.encode(_as_dict(result)).decode(), flush=True)
    else:
        _print(search, result)
    if result.given is None or result.accepted is None:
        return None
    return result.given.name, result.accepted


def _print(search: SearchRequest, result: Assignment) -> None:
    best, accepted = result.given, result.accepted
    if best is not None and best.bid is not None and accepted is not None:
        place, name = place_of(best.bid, ENGLISH), search.object
        told = ENGLISH("give.given", robot=best.name, object=name, place=place)
        print(f"{printable(told)} goal {accepted.goal_id}")
        for note in accepted.notes:
            print(f"note: {printable(note)}")
    elif result.unsure is not None:
        print(printable(ENGLISH("give.unsure", robot=result.unsure.name)), file=sys.stderr)
    else:
        print(ENGLISH("give.nobody"), file=sys.stderr)
    for one in result.others:
        print(printable(f"  {one.name}: {why_not(one, ENGLISH)}"), file=sys.stderr)
    sys.stdout.flush()


def _as_dict(result: Assignment) -> dict[str, object]:
    best, unsure = result.given, result.unsure
    return {
        "robot": None if best is None else best.name,
        "bid": None if best is None else best.bid,
        "accepted": result.accepted,
        "unsure": None if unsure is None else unsure.name,
        "others": [
            {"robot": one.name, "bid": one.bid, "problem": one.problem, "detail": one.detail}
            for one in result.others
        ],
    }
