"""A model of the drawn flat, as the files of the plan are made from it."""

import numpy as np
import pytest

from app.messages.motion import robot_transforms
from app.view.model.scene_model import SceneModel
from ippon.geometry import base_pose
from ippon.robot import ZED
from tests.app.nodes.console.drawn_home import (
    VOXEL_M,
    cloud_of,
    find_of,
    home_voxels,
    proximity_of,
    rooms_of,
    status_of,
    things_of,
)


@pytest.fixture(scope="session")
def flat():
    """The flat of 8 m by 6 m with two rooms, a robot and a find."""
    return flat_on(0)


def flat_on(layers):
    """Return the flat, some layers of voxels above the origin of the map."""
    model = SceneModel()
    model.on_status(status_of("found", find=find_of()))
    indices, labels = home_voxels()
    model.on_keyframe(cloud_of(indices + np.array([0, 0, layers]), labels, 1))
    model.on_proximity(proximity_of())
    T_world_base = base_pose(4.6, 2.6, VOXEL_M * layers, 1.0)
    model.on_transforms(robot_transforms(1, T_world_base, ZED.T_base_camera(0.0)))
    model.trail_world = [(4.0, 2.6, 0.0), (4.6, 2.6, 0.0)]
    model.on_places(rooms_of("<b>Anna's</b> & co").rooms, things_of())
    return model
