"""Rooms that the operator says the object is in, or not in, as weights of the map's rooms.

A room is said by its type ("in the kitchen") or by a name that a person has given it ("in Anna's
room"). The weight of a room is the ratio of its probability to be the one that was said and the
probability of any room, within bounds: no room is excluded.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ippon.geometry import Float64Array
from ippon.guidance.language.context import Claim, read_context
from ippon.guidance.language.context_words import BESIDE
from ippon.guidance.language.mentions import room_phrases
from ippon.rooms.named_rooms import RoomName, names_by_part, names_of_other_floors
from ippon.rooms.room_inference import Rooms
from ippon.rooms.room_names import is_same_name, kind_of_name, plain_name
from ippon.vocabulary import in_words


@dataclass(frozen=True, slots=True, kw_only=True)
class SaidRoomConfig:
    """Weights of rooms in the gain of viewpoints."""

    said_weight: float = 6.0
    """Factor on the gain of views of the room that was said, the largest; more outweighs larger
    differences in level."""
    other_weight: float = 0.25
    """Factor for rooms that are certainly others, the smallest; less leaves them for later."""
    denied_weight: float = 0.05
    """Factor for a room in which the object is said not to be; less leaves it for later."""
    every_s: float = 5.0
    """Robot time between two inferences of the rooms while a room was said; more takes over changes
    later."""

    def __post_init__(self) -> None:
        """Reject weights that would exclude a room, or turn a statement into its opposite."""
        low = min(self.other_weight, self.denied_weight)
        high = max(self.other_weight, self.denied_weight)
        if not (low > 0.0 and high <= 1.0 <= self.said_weight < np.inf and self.every_s > 0.0):
            raise ValueError(
                "other_weight and denied_weight lie in (0, 1], said_weight is finite and at least "
                f"1 and every_s positive; got {self.other_weight}, {self.denied_weight}, "
                f"{self.said_weight}, {self.every_s}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class SaidRoom:
    """One statement about the room of an object."""

    place: str
    """Type or name in lower case, without article: "kitchen", "anna's room"."""
    kind: str
    """Room type; empty if the words name none."""
    negated: bool
    firm: bool
    """Stated, and not only given as a possibility or habit."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoomWeights:
    """What the rooms of the map count, and how it is reported."""

    by_part: Float64Array
    """(P + 1,) factor on the gain of views of each part, 1 for no part."""
    first: tuple[str, ...]
    """Rooms that are searched first, with the source: "kitchen (named by you)"."""
    last: tuple[str, ...]
    """Rooms that are searched last, likewise."""
    missing: tuple[str, ...]
    """Rooms that were said and that the map does not have."""
    other_floor: tuple[str, ...] = ()
    """Rooms that were said and whose name belongs to another floor."""

    @property
    def text(self) -> str:
        """In one line, for the operator."""
        parts = [
            f"looks first in: {', '.join(self.first)}" if self.first else "",
            f"looks last in: {', '.join(self.last)}" if self.last else "",
            f"no room of that name yet: {', '.join(self.missing)}; used as soon as one is named "
            "or recognised"
            if self.missing
            else "",
            f"on another floor: {', '.join(self.other_floor)}; used as soon as the robot is there"
            if self.other_floor
            else "",
        ]
        return "; ".join(filter(None, parts))


def read_said_rooms(
    context: str, names: Iterable[str] = (), *, ooi: str | None = None
) -> tuple[SaidRoom, ...]:
    """Return the rooms that a context says the object is in, or not in.

    Args:
        context: Free text.
        names: Names that people have given to rooms.
        ooi: Canonical label of the goal; its own mentions are not places.
    """
    phrases = {plain_name(name) for name in names} | set(room_phrases(context))
    claims = read_context(context, (), ooi=ooi, rooms=phrases - {""}).claims
    found: dict[str, SaidRoom] = {}
    for claim in claims:
        place = _room_of(claim)
        if place is None:
            continue
        said = in_words(place)
        found.setdefault(
            said,
            SaidRoom(place=said, kind=kind_of_name(said), negated=claim.negated, firm=claim.firm),
        )
    return tuple(found.values())


def weigh_rooms(
    said: Sequence[SaidRoom], rooms: Rooms, names: Iterable[RoomName], config: SaidRoomConfig
) -> RoomWeights:
    """Return the weights of the map's rooms under what was said; without a statement all are 1.

    Args:
        said: Statements about one object. Of several rooms that it may be in, each counts.
        rooms: The inferred rooms.
        names: Names of rooms, by points.
        config: Bounds of the weights.
    """
    names = tuple(names)
    called, elsewhere = names_by_part(rooms, names), names_of_other_floors(rooms, names)
    raised: list[Float64Array] = []
    weight = np.ones(len(rooms.room))
    first: list[str] = []
    last: list[str] = []
    missing: list[str] = []
    other_floor: list[str] = []
    for one in said:
        ratio, known = _ratio(one, rooms, called)
        is_named = bool(known) and known[0].endswith("(named by you)")
        is_other = one.place != in_words(one.kind) and not is_named
        if not known or is_other:
            is_there = any(_is_same(name, one) for name in elsewhere)
            (other_floor if is_there else missing).append(one.place)
        if one.negated and is_other:
            continue  # "Not in Anna's bedroom" excludes no other bedroom.
        (last if one.negated else first).extend(known)
        if one.negated:
            prior = 1.0 / len(rooms.types)
            denied = (1.0 - ratio * prior) / (1.0 - prior) if len(rooms.types) > 1 else ratio
            factor = np.clip(denied, config.denied_weight, 1.0)
            weight *= factor if one.firm else 0.5 * (1.0 + factor)
        else:
            factor = np.clip(ratio, config.other_weight, config.said_weight)
            raised.append(factor if one.firm else 0.5 * (1.0 + factor))
    if raised:
        weight *= np.maximum.reduce(raised)
    weight[0] = 1.0
    return RoomWeights(
        by_part=weight,
        first=tuple(first),
        last=tuple(last),
        missing=tuple(missing),
        other_floor=tuple(other_floor),
    )


def said_parts(said: Iterable[SaidRoom], rooms: Rooms, names: Iterable[RoomName]) -> dict[int, str]:
    """Return the parts of the map that an object is said to be in, with the rooms' names.

    "Anna's bedroom" is a part with that name, not any bedroom.

    Args:
        said: Statements about one object.
        rooms: The inferred rooms.
        names: Names of rooms, by points.
    """
    called = names_by_part(rooms, names)
    found: dict[int, str] = {}
    for one in said:
        if one.negated:
            continue
        same = {part: name for part, name in called.items() if _is_same(name, one)}
        if not same and one.kind in rooms.types and one.place == in_words(one.kind):
            kinds = {part: kind_of_name(plain_name(name)) for part, name in called.items()}
            inferred = np.flatnonzero(rooms.room == rooms.types.index(one.kind)).tolist()
            same = {
                part: called.get(part, one.place)
                for part in (*inferred, *called)
                if part > 0
                and kinds.get(part, "") in ("", one.kind)
                and (part in inferred or kinds[part] == one.kind)
            }
        found |= same
    return found


def is_elsewhere(said: Sequence[SaidRoom], weights: Float64Array, part: int) -> bool:
    """Return whether a part of the map is surely none of the rooms that were said.

    Args:
        said: Statements about one object.
        weights: (P + 1,) of the parts for it.
        part: Number of a part, 0 or less for none.
    """
    firm = any(one.firm for one in said)
    return firm and part > 0 and bool(weights[part] < 0.5) and bool(weights.max() > 1.0)


def _room_of(claim: Claim) -> str | None:
    """Return the room that a claim puts the object in, or excludes; None for none."""
    if claim.kind == "room":
        return None if claim.relation in BESIDE else claim.place
    # "Not on the table in the kitchen" does not exclude the kitchen.
    return None if claim.negated else claim.room


def _ratio(
    one: SaidRoom, rooms: Rooms, called: Mapping[int, str]
) -> tuple[Float64Array, list[str]]:
    """Return the ratio of posterior and prior of each part to be a room, and the known rooms."""
    certain = float(len(rooms.types))
    named = [part for part, name in called.items() if _is_same(name, one)]
    if named:
        ratio = np.zeros(len(rooms.room))
        ratio[named] = certain
        return ratio, [f"{called[named[0]]} (named by you)"]
    if one.kind not in rooms.types:
        return np.ones(len(rooms.room)), []
    column, said = rooms.types.index(one.kind), in_words(one.kind)
    ratio = rooms.probability[:, column] * certain
    known: list[str] = []
    for part, name in called.items():
        kind = kind_of_name(plain_name(name))
        if kind == one.kind and one.place == said:
            ratio[part] = certain
            known.append(f"{name} (named by you)")
        elif kind:
            # The name says what the room is.
            ratio[part] = 0.0
    inferred = np.flatnonzero(rooms.room == column).tolist()
    if any(part > 0 and part not in called for part in inferred):
        known.append(f"{said} (inferred from what is there)")
    return ratio, known


def _is_same(name: str, said: SaidRoom) -> bool:
    """Tell whether a given name is that of a room that was said."""
    return is_same_name(plain_name(name), said.place, said.kind)
