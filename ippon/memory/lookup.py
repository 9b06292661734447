"""Where is, or was last, what somebody names?"""

from collections.abc import Iterable
from dataclasses import dataclass

from ippon.guidance.language.naming import is_instance_of, resolve_object
from ippon.memory.instance import Instance


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

    Those that are still there come before those that are gone. Then the surer ones come first, in
    steps of a tenth, and among these what was seen last.

    Args:
        instances: What is remembered.
        text: As a person types it: "my keys", "couches"; empty for everything.
        vocabulary: Labels of the common objects.

    Raises:
        ValueError: The text is not empty and holds no word.
    """
    if not text.strip():
        found = [Match(instance=one, probability=one.probability) for one in instances]
    else:
        wanted = resolve_object(text, tuple(vocabulary)).canonical
        answers: dict[str, bool] = {}
        found: list[Match] = []
        for one in instances:
            p = _probability(one, wanted, answers)
            if p > 0.0:
                found.append(Match(instance=one, probability=p))
    return tuple(sorted(found, key=_rank))


def _probability(one: Instance, wanted: str, answers: dict[str, bool]) -> float:
    named = ((one.label, one.probability), *one.alternatives)
    best = 0.0
    for label, p in named:
        if label not in answers:
            answers[label] = is_instance_of(label, wanted)
        if answers[label]:
            best += p
    return min(1.0, best)


def _rank(match: Match) -> tuple[bool, int, int, int]:
    one = match.instance
    sure = round(10.0 * match.probability)
    return one.is_gone, -sure, -max(one.last_seen_ns, one.gone_ns), one.instance_id
