"""Reports for the operator: one voxel of the map, and the choice under other levels."""

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.guidance.levels import Guidance, Level
from ippon.mapping.arrays import NOT_MAPPED, OCCUPIED, MapArrays
from ippon.mapping.objects.surface_voxels import NO_LABEL, STEPS_PER_NAT
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.explanation import explain
from ippon.mission.operator_control import SteerablePlanner
from ippon.mission.search import Search
from ippon.planning.interface import Planner
from ippon.planning.plan import NodeKind, Plan, Viewpoint
from ippon.rooms.room_inference import RoomConfig, RoomEvidence, infer_rooms, room_evidence

TOP_LABELS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class VoxelReport:
    """One surface voxel."""

    labels: tuple[tuple[str, float], ...]
    """The most probable common objects and their probabilities, best first; empty before any
    segmentation of the voxel."""
    ooi: float | None
    """p(v in O); None if no image showed it."""
    level: int | None
    """`Level` of the most probable label; None without one."""
    position_xy: tuple[float, float]
    """World position of the voxel, metres."""
    room_evidence: RoomEvidence
    """The map's evidence for rooms."""

    def room(self) -> str:
        """Return the type of the room, empty if unclear. Takes 5 to 40 ms; safe in any thread."""
        return infer_rooms(self.room_evidence, RoomConfig()).name_at(self.position_xy)


@dataclass(frozen=True, slots=True, kw_only=True)
class Preview:
    """The present choice, and the choice with other levels."""

    now: str
    then: str
    before: Viewpoint | None
    after: Viewpoint | None


def inspect_voxel(
    voxel_map: VoxelMap, point_world: Float64Array, floor_z_m: float = 0.0
) -> VoxelReport | None:
    """Report on the voxel that holds a point.

    Args:
        voxel_map: The map.
        point_world: (3,) metres.
        floor_z_m: Height of the floor in the world frame, metres.

    Returns:
        The report, None where there is no surface.
    """
    arrays = voxel_map.arrays()
    voxel = np.floor(point_world / arrays.voxel_size).astype(np.int64)
    block = (voxel >> 3) - arrays.origin_block
    if (block < 0).any() or (block >= np.array(arrays.directory.shape)).any():
        return None
    row = int(arrays.directory[tuple(block)])
    i, j, k = (voxel & 7).tolist()
    cell = (i << 6) | (j << 3) | k
    if row < 0 or arrays.state[row, cell] != OCCUPIED:
        return None
    slab = int(arrays.slab[row])
    slot = int(voxel_map.surface_slots[slab, cell])
    ooi, level = int(arrays.ooi[slab, cell]), int(arrays.level[slab, cell])
    return VoxelReport(
        labels=_labels_of(voxel_map, slot),
        ooi=None if ooi == NOT_MAPPED else ooi / 254.0,
        level=None if level == NOT_MAPPED else level,
        position_xy=(float(point_world[0]), float(point_world[1])),
        room_evidence=room_evidence(voxel_map, RoomConfig(), floor_z_m),
    )


def _labels_of(voxel_map: VoxelMap, slot: int) -> tuple[tuple[str, float], ...]:
    surface, names = voxel_map.surface, voxel_map.labels
    if slot <= 0 or surface.label[slot] == NO_LABEL:
        return ()
    energy = surface.energy[slot, : len(names)].astype(np.float64) / STEPS_PER_NAT
    probability = np.exp(-energy)
    probability /= probability.sum()
    best = np.argsort(-probability, kind="stable")[:TOP_LABELS]
    return tuple((names[n], float(probability[n])) for n in best)


def with_levels(voxel_map: VoxelMap, levels: NDArray[np.uint8]) -> MapArrays:
    """Return the map with other levels of its labels; the map itself does not change.

    Args:
        voxel_map: The map.
        levels: (N,) `Level` of each label.
    """
    arrays = voxel_map.arrays()
    table = np.full(256, NOT_MAPPED, dtype=np.uint8)
    table[: len(levels)] = levels
    labels = voxel_map.surface.label[voxel_map.surface_slots[: len(arrays.level)]]
    level = np.where(arrays.level == NOT_MAPPED, NOT_MAPPED, table[labels]).astype(np.uint8)
    return arrays._replace(level=level)


def preview(
    planner: Planner, plan: Plan, voxel_map: VoxelMap, search: Search, then: Guidance
) -> Preview | None:
    """Return what a planner would choose with other levels; nothing changes.

    Args:
        planner: The planner of the plan.
        plan: Its last plan.
        voxel_map: The map, with the levels of the search.
        search: The present search.
        then: The other levels.

    Returns:
        Both choices in words; None for a planner that has no preview.
    """
    if not isinstance(planner, SteerablePlanner):
        return None
    goal, now = search.goal, search.guidance
    cues = then.labels_of(Level.CERTAIN) == now.labels_of(Level.CERTAIN)
    target = planner.preview(with_levels(voxel_map, then.levels()), cues=cues)
    imagined = dataclasses.replace(
        plan, target=target, closer_look=False, out_of_reach_m=None, by_rule=None, rule_reason=""
    )
    looks = plan.closer_look or plan.out_of_reach_m is not None
    if looks and (target is None or target.kind is not NodeKind.TERMINATING):
        target, imagined = plan.target, plan  # A look is chosen by what was seen, not by levels.
    return Preview(
        now=explain(plan, voxel_map, goal, now),
        then=explain(imagined, voxel_map, goal, then),
        before=plan.target,
        after=target,
    )
