"""Levels from the operator's context, combined with the knowledge table."""

from collections.abc import Sequence

from ippon.guidance.knowledge import Entry, Knowledge
from ippon.guidance.language.context import Claim
from ippon.guidance.language.words import generic
from ippon.guidance.levels import Level
from ippon.guidance.rating import (
    COMPATIBLE_SHARE,
    FAR_SHARE,
    SAME_ROOM_SHARE,
    Rating,
    Rooms,
    overlap,
    rate,
    rate_identity,
    rooms_text,
)
from ippon.vocabulary import in_words

_STATED = {
    "sure": "you said “{claim}”",
    "likely": "you think “{claim}”",
    "habit": "usually “{claim}”",
    "maybe": "perhaps “{claim}”",
}
_OWN_ROOM_SHARE = 0.9
"""Share of a landmark in a room type from which it indicates this room, as a bed the bedroom."""
_TYPICAL_ROOM_SHARE = 0.1
"""Share of a landmark in the stated room below which it indicates another room."""


def rate_by_claims(
    goal: Entry | None, landmark: Entry, claims: Sequence[Claim], knowledge: Knowledge
) -> Rating:
    """Rate a landmark, given what the operator said about the goal's position.

    Firm statements replace the table: the goal is at the stated place, so the landmarks of that
    place count. Typical places of the goal still count if they can be in the same room. Uncertain
    statements (perhaps, usually) are added to the table. A denial excludes places; an uncertain one
    raises none of their landmarks.

    Args:
        goal: Entry of the goal; None for an unknown object.
        landmark: Entry of a common object.
        claims: At least one.
        knowledge: The table.
    """
    at_rooms = landmark.thing.rooms
    if goal is not None:
        identity = rate_identity(goal, landmark, knowledge)
        if identity is not None and identity.level == Level.CERTAIN:
            return identity
    positive = [claim for claim in claims if not claim.negated]
    negative = [claim for claim in claims if claim.negated and claim.firm]
    doubted = [claim for claim in claims if claim.negated and not claim.firm]
    firm = [claim for claim in positive if claim.firm]
    said = [rate_claim(claim, landmark, knowledge) for claim in firm]
    # An uncertain statement can raise a landmark above the firm ones; an uninformative one cannot.
    offered = [rate_claim(claim, landmark, knowledge) for claim in positive if not claim.firm]
    said += [rating for rating in offered if rating.level >= Level.NEAR or not firm]
    best = max(said, key=lambda rating: rating.level, default=None)
    if best is not None and best.level == Level.CERTAIN:
        return best
    denial = _denied(landmark, negative)
    if denial is not None:
        return Rating(level=Level.FAR, reason=f"you said not “{denial.text}”")
    own = _common(goal, landmark, knowledge, negative)
    chosen = own
    if best is not None and not firm:
        chosen = max(best, own, key=lambda rating: rating.level)
    elif best is not None:
        fits = any(_compatible(claim, at_rooms, knowledge) for claim in firm)
        typical = own.level > best.level and own.level >= Level.NEAR and fits
        chosen = own if typical else best
    doubt = _denied(landmark, doubted)
    if doubt is not None and chosen.level > Level.AVERAGE:
        return Rating(level=Level.AVERAGE, reason=f"perhaps not “{doubt.text}”")
    return chosen


def rate_claim(claim: Claim, landmark: Entry, knowledge: Knowledge) -> Rating:
    """Rate a landmark by one positive claim alone."""
    said = _STATED[claim.strength].format(claim=claim.text)
    if claim.kind == "room":
        return _rate_room(claim, landmark, said)
    place = knowledge.find(in_words(claim.place))
    if place is None:
        return Rating(level=Level.AVERAGE, reason="no indication")
    rooms = {claim.room: 1.0} if claim.room else None
    at_rooms = landmark.thing.rooms
    reachable = rooms is None or not at_rooms or overlap(rooms, at_rooms) >= FAR_SHARE
    identity = rate_identity(place, landmark, knowledge)
    if identity is not None and identity.level == Level.CERTAIN and reachable:
        return Rating(level=Level.CERTAIN if claim.firm else Level.NEAR, reason=said)
    found = rate(place, landmark, knowledge, goal_rooms=rooms)
    if found.level == Level.AVERAGE:
        return found
    level = min(found.level, Level.NEAR)
    if not claim.firm:
        return Rating(level=Level.AVERAGE, reason=f"{said}: too unsure to tell")
    return Rating(level=level, reason=f"{said}; {found.reason}")


def _rate_room(claim: Claim, landmark: Entry, said: str) -> Rating:
    subject = generic(in_words(landmark.label))
    if landmark.thing.spread != "none":
        return Rating(level=Level.AVERAGE, reason=f"{subject} in many rooms")
    rooms = landmark.thing.rooms
    share = rooms.get(claim.place, 0.0)
    if share >= _OWN_ROOM_SHARE and claim.firm:
        return Rating(level=Level.CERTAIN, reason=f"{said}, and {subject} hardly anywhere else")
    if share >= SAME_ROOM_SHARE:
        return Rating(level=Level.NEAR, reason=f"{said}, and {subject} mostly there")
    if share < _TYPICAL_ROOM_SHARE and claim.firm:
        return Rating(level=Level.FAR, reason=f"{said}; {subject} in {rooms_text(rooms)}")
    return Rating(level=Level.AVERAGE, reason=f"no indication: {subject} in {rooms_text(rooms, 3)}")


def _denied(landmark: Entry, negative: Sequence[Claim]) -> Claim | None:
    """Return the claim that the goal is not where a landmark is."""
    for claim in negative:
        if claim.kind == "thing":
            hit = claim.place in (landmark.label, landmark.thing.name) and claim.room is None
        else:
            typical = landmark.thing.rooms.get(claim.place, 0.0)
            hit = landmark.thing.spread == "none" and typical >= 0.5
        if hit:
            return claim
    return None


def _common(
    goal: Entry | None, landmark: Entry, knowledge: Knowledge, negative: Sequence[Claim]
) -> Rating:
    """Rate by the table, in the rooms that were not excluded."""
    if goal is None:
        return Rating(level=Level.AVERAGE, reason="no indication")
    excluded = {claim.place for claim in negative if claim.kind == "room"}
    rooms = {room: share for room, share in goal.thing.rooms.items() if room not in excluded}
    total = sum(rooms.values())
    rooms = {room: share / total for room, share in rooms.items()} if total else {}
    return rate(goal, landmark, knowledge, goal_rooms=rooms)


def _compatible(claim: Claim, at_rooms: Rooms, knowledge: Knowledge) -> bool:
    """Tell whether a landmark can be in the room of the stated place."""
    room = claim.place if claim.kind == "room" else claim.room
    if room is not None:
        return not at_rooms or at_rooms.get(room, 0.0) >= _TYPICAL_ROOM_SHARE
    thing = knowledge.thing(claim.place)
    if thing is None or not thing.rooms or not at_rooms:
        return True
    return overlap(thing.rooms, at_rooms) >= COMPATIBLE_SHARE
