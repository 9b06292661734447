"""No sphere of the robot meets an obstacle, and nobody is pinned."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ippon.command import Command
from ippon.control.obstacles import body_clearance, mapped_obstacles
from ippon.control.safety_filter import (
    OVERLAP_TOLERANCE_M,
    filter_among_obstacles,
    filter_command,
    limits_ahead,
)
from ippon.geometry import base_pose
from ippon.robot import HABITAT, ZED

HERE = base_pose(0.0, 0.0, 0.0, 0.0)
AHEAD = Command(linear_m_s=0.8, tilt_rad=-0.2)


def test_in_the_open_a_command_passes_as_it_is(floor_with):
    command, reason = filter_command(AHEAD, HERE, ZED, floor_with(), 0.5)
    assert command == AHEAD
    assert reason is None


def test_a_wall_ahead_slows_then_stops(floor_with):
    speeds = []
    for distance in (2.0, 1.1, 0.8, 0.6, 0.4, 0.2):
        arrays = floor_with((distance, -1.0, 0.0, distance + 0.2, 1.0, 1.0))
        command, reason = filter_command(AHEAD, HERE, ZED, arrays, 0.5)
        speeds.append(command.linear_m_s)
        assert (reason is None) == (command.linear_m_s == AHEAD.linear_m_s)
        assert command.tilt_rad == AHEAD.tilt_rad
    assert speeds == sorted(speeds, reverse=True)
    assert speeds[0] == AHEAD.linear_m_s
    assert speeds[-1] == 0.0


def test_the_reason_says_where_the_obstacle_is(floor_with):
    arrays = floor_with((0.2, -1.0, 0.0, 0.4, 1.0, 1.0))
    _, reason = filter_command(AHEAD, HERE, ZED, arrays, 0.5)
    assert reason is not None
    assert reason.startswith("stopped: obstacle 0.2")
    assert reason.endswith("ahead")
    back = Command(linear_m_s=-0.5)
    _, reason = filter_command(back, base_pose(0, 0, 0, math.pi), ZED, arrays, 0.5)
    assert reason is not None
    assert reason.endswith("behind")


def test_driving_away_from_what_is_too_close_is_allowed(floor_with):
    arrays = floor_with((0.2, -1.0, 0.0, 0.4, 1.0, 1.0))
    back = Command(linear_m_s=-0.4)
    assert filter_command(back, HERE, ZED, arrays, 0.5) == (back, None)
    assert filter_command(AHEAD, HERE, ZED, arrays, 0.5)[0].linear_m_s == 0.0


def test_turning_on_the_spot_stays_possible_beside_a_wall(floor_with):
    arrays = floor_with((0.35, -1.0, 0.0, 0.5, 1.0, 1.0))
    command = Command(linear_m_s=0.8, yaw_rate_rad_s=1.0)
    safe, reason = filter_command(command, HERE, ZED, arrays, 0.5)
    assert safe.linear_m_s < 0.2
    assert safe.yaw_rate_rad_s > 0.0
    assert reason is not None


def test_an_arc_that_passes_is_not_slowed(floor_with):
    arrays = floor_with((0.9, -0.6, 0.0, 1.0, -0.4, 1.0))
    left = Command(linear_m_s=0.5, yaw_rate_rad_s=1.2)
    assert filter_command(left, HERE, ZED, arrays, 0.6) == (left, None)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    linear=st.floats(-0.8, 0.8),
    rate=st.floats(-1.2, 1.2),
    yaw=st.floats(-3.0, 3.0),
    seed=st.integers(0, 200),
)
@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_carrying_out_the_filtered_command_never_meets_an_obstacle(
    floor_with, robot, linear, rate, yaw, seed
):
    rng = np.random.default_rng(seed)
    boxes = []
    for _ in range(5):
        angle, away = rng.random() * 2 * math.pi, 0.6 + rng.random()
        x, y = away * math.cos(angle), away * math.sin(angle)
        boxes.append((x, y, 0.0, x + 0.2, y + 0.2, 1.0))
    arrays = floor_with(*boxes)
    pose = base_pose(0.0, 0.0, 0.0, yaw)
    obstacles = mapped_obstacles(arrays, robot, pose, 3.0)
    start = body_clearance(robot, np.array([[0.0, 0.0, yaw]]), obstacles)[0]
    command = Command(linear_m_s=linear, yaw_rate_rad_s=rate)
    safe, _ = filter_command(command, pose, robot, arrays, 0.4)
    x = y = 0.0
    for _ in range(40):
        x += safe.linear_m_s * 0.01 * math.cos(yaw)
        y += safe.linear_m_s * 0.01 * math.sin(yaw)
        yaw += safe.yaw_rate_rad_s * 0.01
        room = body_clearance(robot, np.array([[x, y, yaw]]), obstacles)[0]
        assert room >= min(-OVERLAP_TOLERANCE_M, start - 0.002) - 0.015


@pytest.mark.parametrize("robot", [ZED, HABITAT])
@pytest.mark.parametrize("margin_m", [0.0, 0.055])
def test_an_obstacle_slows_and_stops_at_the_limits_that_are_told(robot, margin_m):
    speed, horizon_s = robot.max_linear_m_s, 0.4
    slow_m, stop_m = limits_ahead(robot, speed, horizon_s, margin_m)
    assert robot.radius_m < stop_m < slow_m

    def speed_with_obstacle_at(x):
        command = Command(linear_m_s=speed, yaw_rate_rad_s=0.0)
        obstacle = np.array([[x, 0.0]])
        return filter_among_obstacles(command, HERE, robot, obstacle, horizon_s, margin_m)[
            0
        ].linear_m_s

    assert speed_with_obstacle_at(slow_m + 0.02) == speed
    assert 0.0 < speed_with_obstacle_at(slow_m - 0.02) < speed
    assert speed_with_obstacle_at(stop_m + 0.02) > 0.0
    assert speed_with_obstacle_at(stop_m - 0.02) == 0.0
