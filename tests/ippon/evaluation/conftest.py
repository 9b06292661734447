"""A room with a partition, a table with a hat and a chair: distances are known by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.clearance import clearance_at
from ippon.planning.terrain.floor_grid import (
    BEYOND_CUTOFF,
    OBSTACLE,
    OPEN,
    UNSEEN,
    FloorGrid,
    update_nearest_offsets,
)
from ippon.robot import CollisionSphere, RobotProfile
from tests.boxes import boxes_scene
from tests.evaluation_rows import make_row


@pytest.fixture
def make_scene():
    def make(boxes, start=(1.0, 1.0)):
        return boxes_scene(boxes, (start,))

    return make


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


@pytest.fixture(name="make_row")
def make_row_fixture():
    """Rows with figures that a test chooses; everything else is plain."""
    return make_row


@pytest.fixture
def floor_of():
    """A floor whose cells a test draws: `.` open, `#` obstacle, space unseen; rows run along x."""

    def make(rows: list[str], voxel_size: float = 0.1, radius: float = 0.15):
        names = {".": OPEN, "#": OBSTACLE, " ": UNSEEN}
        kind = np.array([[names[c] for c in row] for row in rows], dtype=np.uint8)
        box, cutoff = (0, kind.shape[0], 0, kind.shape[1]), 15
        sites = [np.full((*kind.shape, 2), BEYOND_CUTOFF, dtype=np.int16) for _ in range(2)]
        for value, site in zip((OBSTACLE, UNSEEN), sites, strict=True):
            update_nearest_offsets(kind, value, box, cutoff, site)
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
