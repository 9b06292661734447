"""A room with a partition, a table with a hat and a chair: distances are known by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from ippon.evaluation.row import EpisodeRow
from ippon.planning.clearance import (
    NO_SITE,
    OBSTACLE,
    OPEN,
    UNSEEN,
    BodyLimits,
    FloorGrid,
    clearance_at,
    update_sites,
)
from ippon.robot import CollisionSphere, RobotProfile
from ippon.simulation.scene import Instance, Scene, StartPose

_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def boxes_scene(boxes, start=(1.0, 1.0)) -> Scene:
    vertices, instances = [], []
    for k, (category, label, low, high) in enumerate(boxes):
        pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], dtype=bool)
        vertices.append(np.where(pick, high, low))
        instances.append(
            Instance(
                node=f"{category}.{k}", category=category, label=label, aabb_min=low, aabb_max=high
            )
        )
    owner = np.repeat(np.arange(len(boxes)), len(_FACES))
    return Scene(
        name="boxes",
        source="test",
        instances=tuple(instances),
        start_poses=(StartPose(x=start[0], y=start[1], z=0.0, yaw=0.0),),
        rooms=(),
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=(np.tile(_FACES, (len(boxes), 1)) + 8 * owner[:, None]).astype(np.int32),
        face_instance=owner.astype(np.int32),
        face_colors=np.full((len(owner), 3), 128, np.uint8),
    )


@pytest.fixture
def make_scene():
    return boxes_scene


@pytest.fixture
def flat_boxes():
    """An 8 by 6 m room, parted at x = 4 from y = 0 to 4; a table with a hat behind the wall."""
    return [
        ("floor", "floor", (-0.1, -0.1, -0.1), (8.1, 6.1, 0.0)),
        ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, 6.1, 2.5)),
        ("wall", "wall", (8.0, -0.1, 0.0), (8.1, 6.1, 2.5)),
        ("wall", "wall", (0.0, -0.1, 0.0), (8.0, 0.0, 2.5)),
        ("wall", "wall", (0.0, 6.0, 0.0), (8.0, 6.1, 2.5)),
        ("wall", "wall", (3.95, 0.0, 0.0), (4.05, 4.0, 2.5)),
        ("table", "dining table", (6.0, 1.0, 0.0), (7.0, 2.0, 0.7)),
        ("clothes", "hat", (6.4, 1.4, 0.7), (6.7, 1.7, 0.85)),
        ("chair", "armchair", (1.0, 5.0, 0.0), (1.7, 5.7, 0.9)),
    ]


@pytest.fixture
def robot():
    return RobotProfile(
        name="test",
        spheres=(
            CollisionSphere(x_m=0.0, y_m=0.0, z_m=0.3, radius_m=0.2),
            CollisionSphere(x_m=0.0, y_m=0.0, z_m=1.0, radius_m=0.2),
        ),
        max_linear_m_s=0.5,
        max_yaw_rate_rad_s=1.0,
        max_tilt_rate_rad_s=1.0,
    )


@pytest.fixture
def make_row():
    """Rows with figures that a test chooses; everything else is plain."""

    def make(**change) -> EpisodeRow:
        values = {
            "episode_id": "1.bed.0.untold", "method": "ippon", "home": "1", "start_index": 0,
            "start_x_m": 0.0, "start_y_m": 0.0, "start_yaw_rad": 0.0, "goal": "bed",
            "context": "", "seed": 1, "robot": "zed", "image_width": 320, "image_height": 200,
            "config_hash": "abc", "version": "ippon 0", "success": True, "spl": 0.5,
            "soft_spl": 0.5, "path_length_m": 10.0, "shortest_path_m": 5.0,
            "distance_to_goal_m": 0.0, "ending": "found", "failure": "none", "time_s": 60.0,
            "frames": 100, "hits": 0, "first_seen_s": 3.0, "explored_m2": 20.0, "best_ooi": 1.0,
            "candidates": 1, "path_x_m": (0.0, 1.0), "path_y_m": (0.0, 0.0),
            "planner_ms_p50": 5.0, "planner_ms_p95": 20.0, "step_ms_p50": 8.0, "wall_s": 6.0,
            "cpu_s": 6.0, "realtime_factor": 10.0,
        }  # fmt: skip
        return EpisodeRow(**{**values, **change})

    return make


@pytest.fixture
def floor_of():
    """A floor whose cells a test draws: `.` open, `#` obstacle, space unseen; rows run along x."""

    def make(rows: list[str], voxel_size: float = 0.1, radius: float = 0.15):
        names = {".": OPEN, "#": OBSTACLE, " ": UNSEEN}
        kind = np.array([[names[c] for c in row] for row in rows], dtype=np.uint8)
        box, cutoff = (0, kind.shape[0], 0, kind.shape[1]), 15
        sites = [np.full((*kind.shape, 2), NO_SITE, dtype=np.int16) for _ in range(2)]
        for value, site in zip((OBSTACLE, UNSEEN), sites, strict=True):
            update_sites(kind, value, box, cutoff, site)
        grid = FloorGrid(
            voxel_size=voxel_size, origin=np.zeros(2, np.int64), kind=kind,
            obstacle=sites[0], unseen=sites[1], cutoff=cutoff,
        )  # fmt: skip
        limits = BodyLimits(
            radius=radius, unseen_radius=0.1, slow_clearance=0.25, slow_fraction=0.4, speed=0.5
        )
        return SimpleNamespace(
            grid=grid,
            limits=limits,
            margin_m=0.0,
            floor_z_m=0.0,
            clearance=lambda x, y: clearance_at(grid, float(x), float(y)),
        )

    return make
