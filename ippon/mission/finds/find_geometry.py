"""Distances between robot and finds, and the candidate that the robot has reached."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from ippon.frame import Frame
from ippon.geometry import Float64Array
from ippon.mission.snapshot import Find

SUCCESS_M = 1.0
"""Horizontal distance within which an object is reached: the metre of the task."""
ARRIVED_M = SUCCESS_M + 0.1
"""That distance and the tolerance within which the robot stops at a viewpoint."""
FIND_WITHIN_M = 2.5
"""Largest distance between a find and the robot at the end of a search."""
_MOST_BALLS: Final = 4
"""Along an edge: the map looks each voxel up in all of them."""
_LARGER: Final = 1.25
"""Size of an object, in those of a find that shows most of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExclusionConfig:
    """The region that is excluded from a search with a rejected find."""

    margin_m: float = 0.2
    """Margin around the find; a find that begins within it of the region may be part of the same
    object. More also excludes neighbouring objects."""
    margin_share: float = 0.25
    """That margin for voxels around a large find, as a share of the region's radius; more excludes
    more of a large object's remaining voxels."""
    image_radius_m: float = 0.75
    """Radius of the region at the centre of the image if the rejected find has no voxels any more;
    more excludes more of its surroundings."""

    def __post_init__(self) -> None:
        """Reject regions that exclude nothing."""
        if min(self.margin_m, self.margin_share) < 0.0 or self.image_radius_m <= 0.0:
            raise ValueError(
                "margin_m and margin_share must be at least 0 and image_radius_m above 0; got "
                f"{self.margin_m}, {self.margin_share}, {self.image_radius_m}"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExclusionSphere:
    """A region that is excluded from the search."""

    centre_world: Float64Array
    """(3,) metres."""
    size_m: tuple[float, float, float]
    """Edges of the box around the excluded find."""
    radius_m: float
    margin_m: float
    """Gap up to which a find may belong to the same object."""
    alone: bool = False
    """No more than the find itself is excluded: another such object may stand beside it."""

    @property
    def balls(self) -> list[tuple[Float64Array, float]]:
        """Centre (3,) and radius in metres of each ball that is excluded from the map."""
        if not self.alone:
            return [(self.centre_world, self.radius_m)]
        size = np.array(self.size_m)
        # Small balls along a long box reach less far beyond its sides than one around all of it.
        edge_m = max(size.min(), 3.0 * self.margin_m, size.max() / _MOST_BALLS)
        cells = np.maximum(1.0, np.ceil(size / edge_m - 1e-6))
        edges = size / cells
        radius_m = 0.5 * float(np.linalg.norm(edges)) + self.margin_m
        steps = np.indices(cells.astype(int)).reshape(3, -1).T
        centres = self.centre_world + (steps - 0.5 * (cells - 1.0)) * edges
        return [(centre, radius_m) for centre in centres]

    def is_continued_by(self, find: Find, longest_m: float) -> bool:
        """Return whether a find is part of the excluded object.

        It begins at the sphere, and either its centre lies there, too, or both together are no
        larger than one such object. An object beside a wrong find is neither. Where others may
        stand beside it and their size is not known, its own size tells.

        Args:
            find: A candidate.
            longest_m: Largest extent of one such object.
        """
        reach_m = self.radius_m + self.margin_m
        if gap_m(self.centre_world, find) > reach_m:
            return False
        away = np.abs(self.centre_world - find.position_world)
        own, other = np.array(self.size_m), np.array(find.size_m)
        if self.alone:
            is_inside = bool((away <= 0.5 * own + self.margin_m).all())
        else:
            is_inside = float(np.linalg.norm(away)) <= reach_m
        if is_inside:
            return True
        if self.alone and math.isinf(longest_m):
            longest_m = max(_LARGER * own.max(), own.max() + 2.0 * self.margin_m) + 1e-6
        together = np.maximum(away + 0.5 * (own + other), np.maximum(own, other))
        return float(together.max()) <= longest_m


def exclusion_sphere(config: ExclusionConfig, find: Find) -> ExclusionSphere:
    """Return the region that is excluded when a find is rejected."""
    radius_m = 0.5 * math.hypot(*find.size_m) + config.margin_m
    return ExclusionSphere(
        centre_world=np.array(find.position_world),
        size_m=find.size_m,
        radius_m=radius_m,
        margin_m=max(config.margin_m, config.margin_share * radius_m),
    )


def exclusion_of_itself(find: Find, margin_m: float) -> ExclusionSphere:
    """Return the region that is excluded with a find beside which another one may stand."""
    return ExclusionSphere(
        centre_world=np.array(find.position_world),
        size_m=find.size_m,
        radius_m=0.5 * math.hypot(*find.size_m) + margin_m,
        margin_m=margin_m,
        alone=True,
    )


def nearest_find(
    candidates: Iterable[Find], T_world_base: Float64Array, within_m: float = FIND_WITHIN_M
) -> Find | None:
    """Return the largest candidate near the robot, in view if possible; None without one."""
    near = [f for f in candidates if distance_m(T_world_base, f) < within_m]
    in_view = [f for f in near if f.box_px is not None] or near
    return max(in_view, key=lambda f: f.voxels, default=None)


def reached_find(candidates: Iterable[Find], T_world_base: Float64Array) -> Find | None:
    """Return the candidate that a terminating viewpoint has led to.

    A larger candidate out of reach does not count, such as a chair behind the stool in reach.

    Args:
        candidates: Clusters that may be the object.
        T_world_base: Pose of the robot at the viewpoint.

    Returns:
        The largest one in view and within reach; None if there is none.
    """
    reached = (
        find
        for find in candidates
        if find.box_px is not None and gap_m(T_world_base[:2, 3], find) <= ARRIVED_M
    )
    return max(reached, key=lambda find: find.voxels, default=None)


def same_find(candidates: Iterable[Find], find: Find, within_m: float) -> Find | None:
    """Return the candidate whose centre is nearest to that of an earlier find; None without one."""
    near = (c for c in candidates if math.dist(c.position_world, find.position_world) <= within_m)
    return min(near, key=lambda c: math.dist(c.position_world, find.position_world), default=None)


def at_heights(candidates: Iterable[Find], low_m: float, high_m: float) -> tuple[Find, ...]:
    """Return the candidates whose boxes reach between two heights in the world, metres."""
    return tuple(
        find
        for find in candidates
        if low_m <= find.position_world[2] + 0.5 * find.size_m[2]
        and find.position_world[2] - 0.5 * find.size_m[2] <= high_m
    )


def find_from(candidates: Iterable[Find], T_world_base: Float64Array, away_m: float) -> Find | None:
    """Return the candidate that a search ends at if no path leads closer to it.

    Args:
        candidates: Clusters that may be the object.
        T_world_base: Pose of the robot, as close to the object as it can stand.
        away_m: Horizontal distance from there to the object, metres.

    Returns:
        The find, marked as out of reach if it is farther than `SUCCESS_M`; None if there is none.
    """
    find = nearest_find(candidates, T_world_base, max(FIND_WITHIN_M, away_m + 1.0))
    if find is None or away_m <= SUCCESS_M:
        return find
    return dataclasses.replace(find, out_of_reach_m=away_m)


def distance_m(T_world_base: Float64Array, find: Find) -> float:
    """Return the horizontal distance of a find from the base, metres."""
    x, y, _ = find.position_world
    return math.hypot(x - T_world_base[0, 3], y - T_world_base[1, 3])


def gap_m(at: Float64Array, find: Find) -> float:
    """Return the distance of a find's box from a point (3,), or horizontally from a point (2,)."""
    axes = len(at)
    outside = np.abs(at - find.position_world[:axes]) - 0.5 * np.array(find.size_m[:axes])
    return float(np.linalg.norm(np.maximum(outside, 0.0)))


def looked_at(frame: Frame) -> Float64Array:
    """Return the world point (3,) at the centre of the image, metres."""
    rows, columns = frame.depth.shape
    middle = frame.depth[rows // 3 : rows - rows // 3, columns // 3 : columns - columns // 3]
    seen = middle[np.isfinite(middle) & (middle > 0.0)]
    away = min(float(np.median(seen)), FIND_WITHIN_M) if seen.size else 0.5 * FIND_WITHIN_M
    return frame.T_world_camera[:3, 3] + away * frame.T_world_camera[:3, 2]


def out_of_reach_text(display: str, away_m: float) -> str:
    """Return the text for an object that was found out of reach."""
    return f"found {display}, out of reach: {away_m:.1f} m from the nearest place I can stand"


def counted_text(display: str, found: int, wanted: int | Literal["all"]) -> str:
    """Return how many of the wanted objects were found: "2 of 3 chairs"."""
    if wanted == "all":
        return f"{display}: {found} found"
    return f"{display}: {found} of {wanted} found"


def exhausted_text(
    display: str,
    candidates: Sequence[Find],
    *,
    full: bool = False,
    found: int = 0,
    wanted: int | Literal["all"] = 1,
) -> str:
    """Return why a search ended without a find, or with fewer than wanted, for the operator.

    Args:
        display: The object, in the operator's words.
        candidates: Clusters that may be it, most voxels first.
        full: The roadmap had no room for more viewpoints.
        found: How many were found.
        wanted: How many were wanted.
    """
    why = "everything reachable was seen"
    if full:
        why = "the roadmap is full (planner.max_nodes)"
    if found:
        return f"{counted_text(display, found, wanted)}: {why}"
    text = f"{display} not found: {why}"
    if not candidates:
        return text
    x, y, _ = candidates[0].position_world
    return f"{text}; no path leads close to the most likely candidate, at ({x:.1f}, {y:.1f}) m"
