"""Builds the snapshot of a step."""

from typing import Final

import numpy as np

from ippon.control.walking_guide import WalkingDirections
from ippon.frame import Frame
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.search import Search
from ippon.mission.snapshot import OVER, MissionEvent, MissionState, Snapshot
from ippon.mission.tour import Tour
from ippon.planning.plan import Plan

_NOWHERE: Final = np.zeros((0, 3), np.float32)


def snapshot_of(
    frame: Frame,
    voxel_map: VoxelMap,
    search: Search | None,
    plan: Plan | None,
    *,
    state: MissionState,
    why: str,
    events: tuple[MissionEvent, ...],
    far_evidence_cell_m: float,
    tour: Tour | None = None,
    walk: WalkingDirections | None = None,
) -> Snapshot:
    """Return the snapshot of a step.

    Args:
        frame: The frame of the step.
        voxel_map: The map, with the frame in it.
        search: The search; None without a goal.
        plan: The plan of the step.
        state: State of the mission.
        why: The reason that the operator reads.
        events: Events of the step.
        far_evidence_cell_m: Edge of the cells of `Snapshot.far_evidence`.
        tour: The tour that the search leads; None for one goal.
        walk: Directions for the person who carries the camera.
    """
    candidates = search.candidates if search else ()
    if tour is not None:
        each = (find for one in tour.running for find in one.candidates)
        candidates = tuple(sorted(each, key=lambda find: -find.voxels))
    return Snapshot(
        stamp_ns=frame.stamp_ns,
        state=state,
        why=why,
        goal=search.goal if search else None,
        plan=plan,
        find=search.find if search else None,
        candidates=candidates,
        far_evidence=_NOWHERE if search is None or state in OVER else search.far_evidence.places(),
        far_evidence_cell_m=far_evidence_cell_m,
        T_world_base=frame.T_world_base,
        path_length_m=search.path_length_m if search else 0.0,
        elapsed_s=search.elapsed_s(frame.stamp_ns) if search else 0.0,
        best_ooi=voxel_map.best_ooi() if search else 0.0,
        explored_m2=voxel_map.explored_m2(),
        events=events,
        counted=() if search is None else tuple(search.counted),
        rejected=() if search is None else tuple(search.refused),
        tour=() if tour is None else tour.statuses,
        walk=walk,
    )
