"""Rows of an evaluation, and a home of one room as a folder."""

import numpy as np
import pytest

from ippon.evaluation.row import EpisodeRow
from ippon.simulation.scene import Instance, Scene, StartPose
from ippon.simulation.writer import save_scene

_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
_BOXES = (
    ("floor", "floor", (-0.1, -0.1, -0.1), (6.1, 5.1, 0.0)),
    ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, 5.1, 2.5)),
    ("wall", "wall", (6.0, -0.1, 0.0), (6.1, 5.1, 2.5)),
    ("wall", "wall", (0.0, -0.1, 0.0), (6.0, 0.0, 2.5)),
    ("wall", "wall", (0.0, 5.0, 0.0), (6.0, 5.1, 2.5)),
    ("table", "dining table", (4.6, 1.0, 0.0), (5.6, 2.0, 0.7)),
    ("clothes", "hat", (5.0, 1.4, 0.7), (5.3, 1.7, 0.85)),
    ("chair", "armchair", (0.8, 4.1, 0.0), (1.5, 4.8, 0.9)),
)
_STARTS = ((0.8, 0.8), (1.6, 2.4), (2.6, 0.7), (3.2, 4.2))


@pytest.fixture
def room(tmp_path):
    """A folder with a home: an armchair in one corner, a hat on a table in another."""
    vertices, instances = [], []
    for k, (category, label, low, high) in enumerate(_BOXES):
        pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], dtype=bool)
        vertices.append(np.where(pick, high, low))
        instances.append(
            Instance(
                node=f"{category}.{k}", category=category, label=label, aabb_min=low, aabb_max=high
            )
        )
    owner = np.repeat(np.arange(len(_BOXES)), len(_FACES))
    scene = Scene(
        name="room",
        source="test",
        instances=tuple(instances),
        start_poses=tuple(StartPose(x=x, y=y, z=0.0, yaw=0.0) for x, y in _STARTS),
        rooms=(),
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=(np.tile(_FACES, (len(_BOXES), 1)) + 8 * owner[:, None]).astype(np.int32),
        face_instance=owner.astype(np.int32),
        face_colors=np.full((len(owner), 3), 128, np.uint8),
    )
    folder = tmp_path / "room"
    save_scene(scene, folder)
    return folder


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
