"""A room with a partition, a table with a hat and a chair: distances are known by hand."""

import numpy as np
import pytest

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
