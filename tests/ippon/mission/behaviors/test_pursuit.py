"""On the way to a candidate the camera stays on it."""

import math

import pytest

from ippon.geometry import wrap_angle, yaw_of
from ippon.mission.snapshot import MissionState
from ippon.robot import ZED


@pytest.mark.slow
def test_the_camera_stays_on_what_the_robot_goes_to(searcher, room):
    bed = ("bed", "bed", (6.0, 1.2, 0.0), (7.9, 3.0, 0.55))
    robot = searcher([*room(8.0, 4.5), bed], 1.0, 2.0)
    robot.ask("bed")
    watched = 0
    for result in robot.search(60.0):
        snapshot, command = result.snapshot, result.command
        if snapshot.state is not MissionState.APPROACHING or command.linear_m_s < 0.1:
            continue
        x, y, z = snapshot.T_world_base[:3, 3]
        end = snapshot.plan.target.position_world
        if math.dist((x, y), end[:2]) < 0.5 or not snapshot.candidates:
            continue
        at = min(
            (c.position_world for c in snapshot.candidates), key=lambda p: math.dist(p[:2], end[:2])
        )
        off = wrap_angle(math.atan2(at[1] - y, at[0] - x) - yaw_of(snapshot.T_world_base))
        if abs(off) > 0.5 * ZED.horizontal_fov_rad:
            continue
        towards = math.atan2(at[2] - z - ZED.camera_height_m, math.dist((x, y), at[:2]))
        lowest = max(towards, ZED.min_tilt_rad)
        assert command.tilt_rad == pytest.approx(lowest, abs=0.02)
        watched += 1
    assert watched >= 5
    assert robot.last.state is MissionState.FOUND
