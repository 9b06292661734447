"""A camera in a hand, from its first look at the floor on."""

import math

import numpy as np
import pytest

from ippon.tracking.hand_held import HandHeldCamera
from ippon.tracking.start_pose import AssumedMount


@pytest.mark.slow
def test_it_waits_for_the_floor_and_is_tracked_from_there(walk):
    held = HandHeldCamera(walk.camera, AssumedMount(height_m=1.4, tilt_rad=-0.3))
    color, depth = walk.frames[0]
    waiting = held.track(color, np.zeros_like(depth))
    assert waiting.T_world_camera is None
    assert waiting.problem.startswith("no floor is in view")
    poses = [held.track(*frame).T_world_camera for frame in walk.frames[:30]]
    assert walk.errors([*poses, *walk.poses[30:]])[:30, 0].max() < 0.02


def test_the_first_pose_is_that_of_the_frame_from_which_it_is_tracked(walk):
    """A frame that shows a piece of floor alone gives no pose to one that is turned up."""
    held = HandHeldCamera(walk.camera, AssumedMount(height_m=1.4, tilt_rad=-0.3))
    color, depth = walk.frames[7]
    piece = np.zeros_like(depth)
    piece[-40:, 140:180] = depth[-40:, 140:180]
    first = held.track(color, piece)
    assert first.T_world_camera is None
    assert first.problem.startswith("too little depth in view")
    pose = held.track(*walk.frames[2]).T_world_camera
    assert math.degrees(math.acos(min(1.0, pose[2, :3] @ walk.poses[2][2, :3]))) < 1.5
