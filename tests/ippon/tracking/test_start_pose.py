"""The first pose: upright and above the floor, whatever was assumed within its limits."""

import math

import numpy as np
import pytest

from ippon.tracking.depth_points import points_of
from ippon.tracking.start_pose import AssumedMount, NoFloorError, start_pose


def seen(walk, k):
    return points_of(walk.frames[k][1], walk.camera, 0.3, 5.0).thinned(0.05)


@pytest.mark.parametrize("k", [0, 20, 50, 80])
@pytest.mark.parametrize("mount", [(1.3, -20.0), (1.0, -40.0), (1.6, 0.0)])
def test_up_and_height_are_found_from_a_rough_guess(walk, k, mount):
    height_m, tilt_deg = mount
    assumed = AssumedMount(height_m=height_m, tilt_rad=math.radians(tilt_deg))
    pose = start_pose(seen(walk, k), assumed)
    true = walk.poses[k]
    assert abs(pose[2, 3] - true[2, 3]) < 0.04
    # The direction of up, as the camera sees it.
    assert math.degrees(math.acos(min(1.0, pose[2, :3] @ true[2, :3]))) < 2.0
    assert (pose[0, 3], pose[1, 3]) == (0.0, 0.0)
    assert abs(pose[1, 2]) < 1e-9, "it heads along x"
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)


def test_a_camera_that_shows_no_floor_is_told_what_to_do(walk):
    points = seen(walk, 0)
    wall = points.points @ walk.poses[0][2, :3] + walk.poses[0][2, 3] > 0.8
    above = type(points)(points.points[wall], points.normals[wall])
    with pytest.raises(NoFloorError, match="hold the camera upright"):
        start_pose(above, AssumedMount(height_m=1.3, tilt_rad=-0.3))


def test_a_floor_at_an_impossible_height_is_not_believed(walk):
    with pytest.raises(NoFloorError):
        start_pose(seen(walk, 0), AssumedMount(height_m=2.2, tilt_rad=-0.3))
