"""Small messages for the scene model."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.messages.scene import VoxelCloud
from app.messages.status import FindReport, GoalStatus, Status, Timings
from tests.app.unwatched_viser import unwatched_viser


@pytest.fixture
def server():
    """A viser server that nobody watches."""
    with unwatched_viser() as server:
        yield server


def make_status(**changes):
    status = {
        "robot": "robot",
        "version": "0",
        "stamp_ns": 1_000,
        "wall_ns": 0,
        "state": "searching",
        "why": "",
        "goal": GoalStatus(goal_id=1, object="hat", outcome="active"),
        "queue": [],
        "history": [],
        "find": None,
        "streams": [],
        "timings": Timings(),
        "frames": 1,
        "elapsed_s": 0.0,
        "path_length_m": 0.0,
        "best_ooi": 0.0,
        "explored_m2": 0.0,
        "surface_voxels": 0,
        "voxel_size_m": 0.1,
        "map_revision": 1,
    }
    return Status(**(status | changes))


def make_cloud(indices, stamp_ns=1, *, removed=False, ooi=10):
    indices = np.array(indices).reshape(-1, 3)
    n = len(indices)
    return VoxelCloud(
        stamp_ns=stamp_ns,
        centers_world=((indices + 0.5) * 0.1).astype(np.float32),
        color=np.full((n, 3), 90, np.uint8),
        ooi=np.full(n, ooi, np.uint8),
        proximity=np.full(n, 20, np.uint8),
        level=np.full(n, 1, np.uint8),
        label=np.full(n, 3, np.uint8),
        confidence=np.full(n, 200, np.uint8),
        removed=np.full(n, removed),
    )


def make_find(**changes):
    find = {
        "goal_id": 1,
        "object": "hat",
        "position_world": (2.0, 2.0, 0.3),
        "size_m": (0.2, 0.2, 0.2),
        "probability": 0.9,
        "voxels": 2,
    }
    return FindReport(**(find | changes))


@pytest.fixture
def make():
    """Builders of messages."""
    return SimpleNamespace(status=make_status, cloud=make_cloud, find=make_find)
