"""The reason for the robot's target, in one line."""

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.guidance.levels import Guidance, Level
from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, OCCUPIED
from ippon.mapping.objects.surface_voxels import NO_LABEL
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.goal import Goal
from ippon.planning.plan import NodeKind, Plan, Viewpoint
from ippon.vocabulary import in_words

NEARBY_M = 2.5
"""Distance within which a common object is named as being beside a viewpoint."""
_FAR_EVIDENCE_NAT = 0.5
"""Log-likelihood ratio from which far evidence is named as the reason."""
_UNSEEN = "in unseen space"
_AHEAD = "ahead"
_MOST_NAMED = 3
_PERVASIVE = frozenset({"wall", "floor", "ceiling", "beam", "column", "others", "objects"})


def explain(plan: Plan, voxel_map: VoxelMap, goal: Goal, guidance: Guidance) -> str:
    """Return where the plan leads, what is nearby, its gain and its travel time, in one line.

    Args:
        plan: The plan that the robot follows.
        voxel_map: The map that it was made from.
        goal: The object.
        guidance: Levels of the map's labels for that goal.
    """
    target = plan.target
    if target is None:
        return f"looking for a way on towards {goal.display}"
    if target.kind is NodeKind.TERMINATING:
        voxels = round(target.termination)
        return (
            f"going to where {goal.display} can be seen from close by: "
            f"{voxels} voxel{'s' if voxels != 1 else ''}, {target.path_cost_s:.1f} s away"
        )
    if plan.out_of_reach_m is not None:
        return (
            f"no way leads close to {goal.display}: going to where it can be seen from, "
            f"{plan.out_of_reach_m:.1f} m off, {target.path_cost_s:.1f} s away"
        )
    if plan.closer_look:
        return f"going closer to what may be {goal.display}, {target.path_cost_s:.1f} s away"
    if plan.by_rule and plan.rule_reason:
        return (
            f"by the method's rule, {plan.rule_reason}: worth {target.gain:.2f}, "
            f"{target.path_cost_s:.1f} s away"
        )
    if plan.by_rule:
        return (
            f"going where the method's rule leads: worth {target.gain:.2f}, "
            f"{target.path_cost_s:.1f} s away"
        )
    if target.far_evidence_nat >= _FAR_EVIDENCE_NAT:
        return (
            f"going to see whether that is {goal.display}, farther off: "
            f"gain {target.gain:.0f}, {target.path_cost_s:.1f} s away"
        )
    level = target.level.text
    place = _place(target, voxel_map, guidance)
    certain = [label for label in guidance.labels_of(Level.CERTAIN) if label != goal.object]
    if target.cued and certain and place == _AHEAD:
        names = [in_words(label) for label in certain]
        place = f"by what may be the {' or the '.join(names[:_MOST_NAMED])}, farther off"
    return (
        f"going to the viewpoint {place} ({level}): gain {target.gain:.0f}, "
        f"{target.path_cost_s:.1f} s away"
    )


def _place(target: Viewpoint, voxel_map: VoxelMap, guidance: Guidance) -> str:
    """Return the common object that gives the viewpoint its level, as in "by the sofa"."""
    counts = label_census(voxel_map, np.array(target.position_world), NEARBY_M)
    by = [
        n * (row.level is target.level and row.label not in _PERVASIVE)
        for n, row in zip(counts.tolist(), guidance.rows, strict=True)
    ]
    if any(by):
        return f"by the {in_words(guidance.rows[by.index(max(by))].label)}"
    return _UNSEEN if target.level is Level.AVERAGE else _AHEAD


def label_census(
    voxel_map: VoxelMap, centre_world: NDArray[np.float64], radius_m: float
) -> NDArray[np.int64]:
    """Count the surface voxels of each label within a horizontal distance of a point.

    Args:
        voxel_map: The map.
        centre_world: (3,) metres; its height does not matter.
        radius_m: Radius of the vertical cylinder around the point.

    Returns:
        (N,) int64, one count for each of the map's labels.
    """
    counts = np.zeros(len(voxel_map.labels), dtype=np.int64)
    arrays = voxel_map.arrays()
    _census_kernel(
        arrays.directory,
        arrays.origin_block,
        arrays.state,
        arrays.slab,
        voxel_map.surface_slots,
        voxel_map.surface.label,
        centre_world[:2] / arrays.voxel_size,
        radius_m / arrays.voxel_size,
        counts,
    )
    return counts


@njit(cache=True, nogil=True)
def _census_kernel(directory, origin, state, slab, slot, label, centre, radius, counts):
    x0 = max(0, int(np.floor((centre[0] - radius) / BLOCK_EDGE)) - origin[0])
    y0 = max(0, int(np.floor((centre[1] - radius) / BLOCK_EDGE)) - origin[1])
    x1 = int(np.floor((centre[0] + radius) / BLOCK_EDGE)) - origin[0] + 1
    y1 = int(np.floor((centre[1] + radius) / BLOCK_EDGE)) - origin[1] + 1
    for bx in range(x0, min(x1, directory.shape[0])):
        for by in range(y0, min(y1, directory.shape[1])):
            for bz in range(directory.shape[2]):
                row = directory[bx, by, bz]
                if row < 0:
                    continue
                for c in range(BLOCK_VOLUME):
                    if state[row, c] != OCCUPIED:
                        continue
                    of = label[slot[slab[row], c]]
                    if of == NO_LABEL:
                        continue
                    dx = (origin[0] + bx) * BLOCK_EDGE + c // 64 + 0.5 - centre[0]
                    dy = (origin[1] + by) * BLOCK_EDGE + (c // 8) % 8 + 0.5 - centre[1]
                    if dx * dx + dy * dy <= radius * radius:
                        counts[of] += 1
