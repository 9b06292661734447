"""Bids of robots in words: what they know of a place, and why they did not get a goal."""

from app.links.fleet.bids import RobotBid
from app.messages.control import Bid
from app.view.words import Words


def why_not(one: RobotBid, say: Words) -> str:
    """Return why a robot did not get the goal, and what it knows of the place."""
    if one.problem == "old" and one.detail:
        return say("give.problem.old.version", version=one.detail)
    if one.problem:
        return say(f"give.problem.{one.problem}", detail=say.said(one.detail))
    assert one.bid is not None
    bid = one.bid
    if not bid.obstacle:
        return f"{say('give.free')} · {place_of(bid, say)}"
    # Of a robot without data a sentence, else the name of an object or of a person.
    detail = bid.detail
    if bid.obstacle in ("lost", "searching"):
        detail = say.said(detail) if bid.obstacle == "lost" else say.name(detail)
    return f"{say(f'give.why.{bid.obstacle}', detail=detail)} · {place_of(bid, say)}"


def place_of(bid: Bid, say: Words) -> str:
    """Return what a robot knows of the place of a search, and how far that is."""
    if bid.ground == "area":
        return say("give.place.area", m2=say.number(bid.explored_m2))
    place = say.name(bid.place) if bid.ground == "thing" else say.room(bid.place)
    if bid.ground == "unknown":
        return say("give.place.unknown", place=place) if place else say("give.place.nothing")
    key = f"give.place.{bid.ground}"
    if bid.way_m is None:
        return say(f"{key}.no_way", place=place)
    if bid.ground == "thing" and bid.room:
        key = f"{key}.room"
    return say(key, place=place, room=say.room(bid.room), m=say.number(bid.way_m, 1))
