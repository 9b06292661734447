"""Where is, or was last, what somebody names?"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final
from unicodedata import normalize

from ippon.guidance.language.naming import is_instance_of, resolve_object
from ippon.memory.instance import Instance, box_overlap

_REPEATED: Final = 0.5
"""Common part of two boxes, as a share of the smaller, from which both are of one thing."""
_ALIKE: Final = 6.0
"""Ratio of the volumes of two boxes up to which both may be of one thing."""
_BEFORE_NAMES: Final = ("the ", "my ", "our ")


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """A thing that answers a question."""

    instance: Instance
    probability: float
    """That it is what was asked for."""


def find_instances(
    instances: Iterable[Instance], text: str, vocabulary: Iterable[str]
) -> tuple[Match, ...]:
    """Return the things that a text names, best first.

    A name that a person has given stands for that thing alone. Among everything, what a search
    has found is listed once, without what the map takes it for. Of other things, those that are
    still there come before those that are gone. Then the surer ones come first, in steps of a
    tenth, and among these what was seen last.

    Args:
        instances: What is remembered.
        text: As a person types it: "my keys", "couches"; empty for everything.
        vocabulary: Labels of the common objects.

    Raises:
        ValueError: The text is not empty and holds no word.
    """
    instances = tuple(instances)
    named = instance_named(instances, text)
    if named is not None:
        return (Match(instance=named, probability=1.0),)
    if not text.strip():
        found = [match_of(one) for one in _without_repeats(instances)]
    else:
        wanted = resolve_object(text, tuple(vocabulary)).canonical
        answers: dict[str, bool] = {}
        found: list[Match] = []
        for one in instances:
            p = _probability(one, wanted, answers)
            if p > 0.0:
                found.append(Match(instance=one, probability=p))
    return tuple(sorted(found, key=_rank))


def instance_named(instances: Iterable[Instance], text: str) -> Instance | None:
    """Return the thing that a person has given a name; None where nothing has it.

    Args:
        instances: What is remembered.
        text: The name; case, spaces, "the" and "my" make no difference.
    """
    wanted = plain_name(text)
    if not wanted:
        return None
    return next((one for one in instances if one.name and plain_name(one.name) == wanted), None)


def plain_name(text: str) -> str:
    """Return a name as names are compared."""
    text = normalize("NFC", text).replace("\N{RIGHT SINGLE QUOTATION MARK}", "'")
    plain = " ".join(text.casefold().split())
    before = next((word for word in _BEFORE_NAMES if plain.startswith(word)), "")
    return plain[len(before) :]


def match_of(one: Instance) -> Match:
    """Return a thing as an answer to a question about everything."""
    return Match(instance=one, probability=one.beliefs[0][1] if one.beliefs else 0.0)


def _without_repeats(instances: tuple[Instance, ...]) -> list[Instance]:
    """Leave out what the map shows of a thing that a search has found, by a label of its own.

    A hat is found as a hat, and is clothes among the common objects; what it lies on is larger.
    """
    finds = [one for one in instances if one.source == "search" and not one.is_gone]

    def repeats(one: Instance, find: Instance) -> bool:
        reach_m = sum(one.size_m) + sum(find.size_m)
        if math.dist(one.position_world, find.position_world) > reach_m:
            return False
        large, small = math.prod(one.size_m), math.prod(find.size_m)
        alike = max(large, small) <= _ALIKE * min(large, small)
        return alike and box_overlap(one, find) >= _REPEATED

    return [
        one
        for one in instances
        if one.source == "search" or one.name or not any(repeats(one, find) for find in finds)
    ]


def _probability(one: Instance, wanted: str, answers: dict[str, bool]) -> float:
    best = 0.0
    for label, p in one.beliefs:
        if label not in answers:
            answers[label] = is_instance_of(label, wanted)
        if answers[label]:
            best += p
    return min(1.0, best)


def _rank(match: Match) -> tuple[bool, int, int, int]:
    one = match.instance
    sure = round(10.0 * match.probability)
    return one.is_gone, -sure, -max(one.last_seen_ns, one.gone_ns), one.instance_id
