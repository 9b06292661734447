"""What a demo's home holds: nobody knows what to ask for in a home that is drawn from a seed."""

from collections import Counter
from typing import Final

from ippon.evaluation.goal_objects import matching_instances
from ippon.guidance.language.requests.sentence import goal_named
from ippon.memory.map_clusters import STRUCTURE
from ippon.simulation.scene import Scene

_SHOWN: Final = 40


def holds(scene: Scene, wanted: str) -> bool:
    """Return whether a home holds what is searched for, its attributes aside."""
    named = goal_named(wanted)
    return len(matching_instances(scene, wanted if named is None else named.object)) > 0


def said_contents(scene: Scene) -> str:
    """Return the names of a home's things in one sentence, those that it has fewest of first."""
    counts = Counter(one.label for one in scene.instances if one.label not in STRUCTURE)
    names = sorted(counts, key=lambda name: (counts[name], name))
    more = "" if len(names) <= _SHOWN else f" and {len(names) - _SHOWN} more"
    return f"in this home: {', '.join(names[:_SHOWN])}{more}"
