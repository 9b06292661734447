"""A model of the drawn flat, as the files of the plan are made from it."""

import pytest

from app.view.model.scene_model import SceneModel
from ippon.geometry import base_pose
from tests.app.nodes.console.drawn_home import (
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
    model = SceneModel()
    model.on_status(status_of("found", find=find_of()))
    model.on_keyframe(cloud_of(*home_voxels(), 1))
    model.on_proximity(proximity_of())
    model.T_world_base = base_pose(4.6, 2.6, 0.0, 1.0)
    model.trail_world = [(4.0, 2.6, 0.0), (4.6, 2.6, 0.0)]
    model.on_places(rooms_of("<b>Anna's</b> & co").rooms, things_of())
    return model
