"""One thing that is remembered."""

from dataclasses import dataclass
from typing import Literal

from ippon.frame import UNDERFOOT_M
from ippon.geometry import Float64Array
from ippon.guidance.knowledge import WITHIN_REACH_M

Source = Literal["map", "search"]

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """One thing as map or search show it now."""

    label: str
    """Canonical."""
    alternatives: tuple[tuple[str, float], ...] = ()
    """Other labels that it may have, with their probabilities, best first."""
    probability: float
    """Of the label."""
    position_world: Point
    """Centre of the voxels, metres."""
    size_m: Point
    """Extent of the axis-aligned box round the voxels."""
    voxels: int
    attributes: tuple[str, ...] = ()
    """What a search has seen of it: "red", "large"."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Instance(Sighting):
    """A thing with an identity that lasts."""

    instance_id: int
    source: Source
    """Who saw it: the map, which tells the common objects apart, or a search for it."""
    first_seen_ns: int
    """Nanoseconds since 1970, like all times here."""
    last_seen_ns: int
    gone_ns: int = 0
    """When it was noticed that it is not there any more; 0 while it is."""
    room: str = ""
    """Type of the room that it is in; empty where that is not clear."""
    view_score: float = 0.0
    """Of its best picture, see `ippon.memory.best_view`; 0 without one."""
    name: str = ""
    """What a person calls it; empty for nothing."""
    denied: tuple[str, ...] = ()
    """Labels that it does not have, as a person said."""

    @property
    def is_gone(self) -> bool:
        """It is not there any more."""
        return self.gone_ns != 0

    @property
    def beliefs(self) -> tuple[tuple[str, float], ...]:
        """Labels that it may have with their probabilities, best first: none that was denied."""
        seen = ((self.label, self.probability), *self.alternatives)
        if not self.denied:
            return seen
        left = 1.0 - sum(p for label, p in seen if label in self.denied)
        return tuple(
            (label, min(1.0, p / max(left, p))) for label, p in seen if label not in self.denied
        )

    @property
    def believed(self) -> str:
        """The label that it has most probably; empty where all were denied."""
        return next((label for label, _ in self.beliefs), "")


def box_overlap(one: Sighting, other: Sighting) -> float:
    """Return the common part of two boxes as a share of the smaller one, from 0 to 1."""
    common, smaller = 1.0, 1.0
    for axis in range(3):
        a, b = one.size_m[axis], other.size_m[axis]
        gap = abs(one.position_world[axis] - other.position_world[axis])
        reach = min(0.5 * (a + b) - gap, a, b)
        if reach <= 0.0:
            return 0.0
        common *= reach
        smaller *= min(a, b)
    return common / smaller


def is_on_floor(one: Sighting, floor_z_m: float) -> bool:
    """Return whether a thing stands on a floor or hangs within reach above it."""
    height_m = one.position_world[2] - floor_z_m
    return height_m > -UNDERFOOT_M and height_m - 0.5 * one.size_m[2] < WITHIN_REACH_M


def box_of(low: Float64Array, high: Float64Array) -> tuple[Point, Point]:
    """Return centre and size of a box given by its corners, (3,) metres each."""
    x, y, z = (float(c) for c in 0.5 * (low + high))
    sx, sy, sz = (float(s) for s in high - low)
    return (x, y, z), (sx, sy, sz)
