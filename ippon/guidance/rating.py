"""Proximity of two things by the knowledge table: the rules of the embedded prior.

The rules follow the level definitions of the paper's prompt. Each rates how likely the goal is near
a landmark at which the robot stands. The rating of (goal, landmark) differs from that of (landmark,
goal).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ippon.guidance.knowledge import Entry, Knowledge, Place, Relation
from ippon.guidance.language.naming import wider
from ippon.guidance.language.words import generic, with_article
from ippon.guidance.levels import Level
from ippon.vocabulary import in_words

SAME_ROOM_SHARE = 0.5
"""Probability of the same room from which a landmark is NEAR."""
REVERSE_SHARE = 0.4
"""The same for a landmark that is typically found at the goal."""
COMPATIBLE_SHARE = 0.3
"""Overlap of rooms from which a typical place still counts beside the operator's words."""
FAR_SHARE = 0.05
"""Overlap of rooms below which a landmark is FAR."""

Rooms = Mapping[str, float]

_ENCLOSING = frozenset({"floor", "wall", "ceiling"})
_PHRASES: Mapping[Relation, str] = {
    "sure": "{things_are} always at the {place}",
    "on": "{things_are} often on the {place}",
    "in": "{things_are} often kept in the {place}",
    "by": "{things_are} usually close to the {place}",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Rating:
    """A level with its reason."""

    level: Level
    reason: str


def overlap(one: Rooms, other: Rooms) -> float:
    """Return the overlap of two room distributions, 0 to 1."""
    return sum(min(share, other.get(room, 0.0)) for room, share in one.items())


def same_room(one: Rooms, other: Rooms) -> float:
    """Return the probability that two independent things are in the same room type."""
    return sum(share * other.get(room, 0.0) for room, share in one.items())


def rate(
    goal: Entry,
    landmark: Entry,
    knowledge: Knowledge,
    *,
    goal_rooms: Rooms | None = None,
) -> Rating:
    """Rate the proximity of a landmark to a goal.

    Args:
        goal: The goal.
        landmark: A common object.
        knowledge: The table.
        goal_rooms: Rooms of the goal; by default the table's.
    """
    in_rooms = goal.thing.rooms if goal_rooms is None else goal_rooms
    at_rooms = landmark.thing.rooms
    identity = rate_identity(goal, landmark, knowledge)
    if identity is not None:
        return identity
    if landmark.thing.spread == "pervasive":
        return Rating(
            level=Level.AVERAGE, reason=f"{generic(in_words(landmark.label))} in every room"
        )
    if landmark.thing.spread == "broad":
        return Rating(
            level=Level.AVERAGE,
            reason=f"“{in_words(landmark.label)}” is too broad to say anything",
        )
    apart = bool(in_rooms and at_rooms) and overlap(in_rooms, at_rooms) < FAR_SHARE
    if not apart:
        direct = _rate_places(goal, landmark, knowledge, in_rooms, at_rooms)
        if direct is not None:
            return direct
    if landmark.thing.spread == "everywhere":
        return Rating(
            level=Level.AVERAGE, reason=f"{generic(in_words(landmark.label))} in many rooms"
        )
    return _rate_rooms(goal, landmark, in_rooms, at_rooms)


def rate_identity(goal: Entry, landmark: Entry, knowledge: Knowledge) -> Rating | None:
    """Rate a landmark that is the goal, a wider thing, or a kind of it; None for any other."""
    name = in_words(goal.label)
    if goal.label == landmark.label:
        return Rating(level=Level.CERTAIN, reason="this is what you are looking for")
    above = wider(goal, knowledge)
    if landmark.label in above and landmark.thing.spread == "none":
        first = next(
            (label for label in above if _spread(label, knowledge) == "none"), landmark.label
        )
        certain = landmark.label in (first, goal.thing.name)
        return Rating(
            level=Level.CERTAIN if certain else Level.NEAR,
            reason=f"{with_article(name)} may be seen as {with_article(in_words(landmark.label))}",
        )
    if goal.label in wider(landmark, knowledge) and goal.thing.spread == "none":
        kind = f"{with_article(in_words(landmark.label))} is a kind of {name}"
        return Rating(level=Level.CERTAIN, reason=kind)
    if goal.label in _ENCLOSING:
        return Rating(level=Level.CERTAIN, reason=f"every room has {with_article(name)}")
    return None


def _spread(label: str, knowledge: Knowledge) -> str:
    thing = knowledge.thing(label)
    return thing.spread if thing else "none"


def _rate_places(
    goal: Entry, landmark: Entry, knowledge: Knowledge, in_rooms: Rooms, at_rooms: Rooms
) -> Rating | None:
    """Rate a landmark at which the goal is found, or that is found at the goal."""
    place = _place_at(goal, landmark, knowledge, in_rooms, at_rooms)
    if place is not None:
        text = _placed(goal, place.relation, landmark)
        level = Level.CERTAIN if place.relation == "sure" else Level.NEAR
        return Rating(level=level, reason=text)
    back = _place_at(landmark, goal, knowledge, at_rooms, in_rooms)
    if back is not None:
        text = _placed(landmark, back.relation, goal)
        if back.relation == "sure":
            return Rating(level=Level.CERTAIN, reason=text)
        if same_room(in_rooms, at_rooms) >= REVERSE_SHARE:
            return Rating(level=Level.NEAR, reason=text)
    return None


def _place_at(
    thing: Entry, place: Entry, knowledge: Knowledge, in_rooms: Rooms, at_rooms: Rooms
) -> Place | None:
    """Return the relation of a thing to a place, or to a wider thing of the place."""
    names = {place.label}
    if overlap(in_rooms, at_rooms) >= COMPATIBLE_SHARE or not at_rooms:
        names.update(wider(place, knowledge))
    return next((found for found in thing.thing.places if found.name in names), None)


def _rate_rooms(goal: Entry, landmark: Entry, in_rooms: Rooms, at_rooms: Rooms) -> Rating:
    name, other = in_words(goal.label), in_words(landmark.label)
    if not in_rooms or not at_rooms:
        return Rating(level=Level.AVERAGE, reason="no indication")
    if overlap(in_rooms, at_rooms) < FAR_SHARE:
        there, here = rooms_text(at_rooms), rooms_text(in_rooms)
        text = f"{generic(other)} in {there}, {generic(name)} in {here}"
        return Rating(level=Level.FAR, reason=text)
    if same_room(in_rooms, at_rooms) >= SAME_ROOM_SHARE:
        shared = max(at_rooms, key=lambda room: at_rooms[room] * in_rooms.get(room, 0.0))
        subject, _, verb = generic(name).rpartition(" ")
        text = f"{generic(other)} mostly in the {in_words(shared)}, and so are {subject}"
        if verb == "is":
            text = f"{generic(other)} mostly in the {in_words(shared)}, and so is {subject}"
        return Rating(level=Level.NEAR, reason=text)
    text = f"no indication: {generic(other)} in {rooms_text(at_rooms, 3)}"
    return Rating(level=Level.AVERAGE, reason=text)


def rooms_text(rooms: Rooms, most: int = 2) -> str:
    """Return the most likely rooms in words: "the kitchen or the bathroom"."""
    ranked = sorted(rooms, key=lambda room: -rooms[room])[:most]
    named = [f"the {in_words(room)}" for room in ranked if rooms[room] >= 0.1]
    return " or ".join([", ".join(named[:-1]), named[-1]] if len(named) > 1 else named)


def _placed(thing: Entry, relation: Relation, place: Entry) -> str:
    """Return where a thing is found: "hats are often on the sofa"."""
    return _PHRASES[relation].format(
        things_are=generic(in_words(thing.label)), place=in_words(place.label)
    )
