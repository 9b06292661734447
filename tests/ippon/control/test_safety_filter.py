"""No sphere of the robot meets an obstacle, and nobody is pinned."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

from ippon.command import Command
from ippon.control.obstacles import Hazards, body_clearance, mapped_obstacles
from ippon.control.safety_filter import (
    OVERLAP_TOLERANCE_M,
    _stopping_paths,
    filter_among_hazards,
    filter_command,
    limits_ahead,
)
from ippon.geometry import base_pose
from ippon.robot import HABITAT, ZED, RobotProfile
from tests.long_robot import LONG

HERE = base_pose(0.0, 0.0, 0.0, 0.0)
SHARES = (1.0, 0.75, 0.5, 0.3, 0.15)
HORIZON_S = 0.4
quick = settings(max_examples=30, deadline=None)
AHEAD = Command(linear_m_s=0.8, tilt_rad=-0.2)
NONE = np.zeros((0, 2))


def filter_among(command, pose, robot, obstacles, *limits):
    """Filter a command among obstacles, without drops."""
    return filter_among_hazards(command, pose, robot, Hazards(obstacles, NONE), *limits)


def motion(command: Command, pose, robot: RobotProfile, horizon_s: float, apart=True) -> np.ndarray:
    """Return (N, 3) poses, a millisecond apart, of a command and of braking after it.

    Linear and yaw rate brake apart, each by its own limit, or together.
    """
    x, y, yaw = pose
    linear, rate = command.linear_m_s, command.yaw_rate_rad_s
    stop_s = abs(linear) / robot.max_linear_acceleration_m_s2
    stop_turning_s = abs(rate) / robot.max_yaw_acceleration_rad_s2
    if not apart:
        stop_s = stop_turning_s = stop_s if robot.is_round else max(stop_s, stop_turning_s)
    time_s = horizon_s + max(stop_s, stop_turning_s)
    steps = math.ceil(1e3 * time_s)
    step_s = time_s / steps
    t = (np.arange(steps) + 0.5) * step_s
    driven = linear * step_s * np.clip(1.0 - (t - horizon_s) / max(stop_s, 1e-9), 0.0, 1.0)
    turned = rate * step_s * np.clip(1.0 - (t - horizon_s) / max(stop_turning_s, 1e-9), 0.0, 1.0)
    heading = yaw + np.cumsum(turned) - 0.5 * turned
    along = driven[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    return np.column_stack([np.add((x, y), np.cumsum(along, axis=0)), yaw + np.cumsum(turned)])


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
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    linear=st.floats(-0.8, 0.8),
    rate=st.floats(-1.2, 1.2),
    yaw=st.floats(-3.0, 3.0),
    seed=st.integers(0, 200),
)
# Turning stops 0.5 s before driving does.
@example(linear=-0.625, rate=0.625, yaw=2.5625, seed=9)
@pytest.mark.parametrize("robot", [ZED, HABITAT, LONG])
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
    start = body_clearance(robot, np.array([[0.0, 0.0, yaw]]), obstacles)
    command = Command(linear_m_s=linear, yaw_rate_rad_s=rate)
    safe, _ = filter_command(command, pose, robot, arrays, 0.4)
    allowed = np.minimum(-OVERLAP_TOLERANCE_M, start - 0.002)
    for apart in (True, False):
        poses = motion(safe, (0.0, 0.0, yaw), robot, 0.4, apart)
        assert (body_clearance(robot, poses, obstacles) >= allowed - 0.015).all()


@pytest.mark.parametrize("robot", [ZED, HABITAT, LONG])
@pytest.mark.parametrize("margin_m", [0.0, 0.055])
def test_an_obstacle_slows_and_stops_at_the_limits_that_are_told(robot, margin_m):
    speed, horizon_s = robot.max_linear_m_s, 0.4
    slow_m, stop_m = limits_ahead(robot, speed, horizon_s, margin_m)
    assert robot.radius_m < stop_m < slow_m

    def speed_with_obstacle_at(x):
        command = Command(linear_m_s=speed, yaw_rate_rad_s=0.0)
        obstacle = np.array([[x, 0.0]])
        return filter_among(command, HERE, robot, obstacle, horizon_s, margin_m)[
            0
        ].linear_m_s

    assert speed_with_obstacle_at(slow_m + 0.02) == speed
    assert 0.0 < speed_with_obstacle_at(slow_m - 0.02) < speed
    assert speed_with_obstacle_at(stop_m + 0.02) > 0.0
    assert speed_with_obstacle_at(stop_m - 0.02) == 0.0


def test_room_that_one_obstacle_takes_is_not_granted_towards_another():
    behind = np.array([[-0.12, 0.0]])
    wall = np.column_stack([np.full(21, 0.6), np.linspace(-1.0, 1.0, 21)])
    command, reason = filter_among(AHEAD, HERE, ZED, np.vstack([behind, wall]), HORIZON_S)
    assert 0.0 < command.linear_m_s < AHEAD.linear_m_s, "away from the one behind"
    assert command == filter_among(AHEAD, HERE, ZED, wall, HORIZON_S)[0]
    assert reason is not None
    assert reason.endswith("0.60 m ahead")


def test_a_long_body_has_room_to_stop_turning():
    # The nose reaches it after 0.7 rad, beyond the 0.48 rad that 0.4 s of turning sweep.
    post = np.array([[0.252, 0.36]])
    turn = Command(yaw_rate_rad_s=1.2)
    command, reason = filter_among(turn, HERE, LONG, post, HORIZON_S)
    assert abs(command.yaw_rate_rad_s) < 1.2
    assert reason is not None
    swept = motion(command, (0.0, 0.0, 0.0), LONG, HORIZON_S)
    assert body_clearance(LONG, swept, post).min() >= -OVERLAP_TOLERANCE_M - 0.002


@pytest.mark.parametrize("robot", [ZED, LONG])
@pytest.mark.parametrize("speed", [-0.8, 0.2, 0.8])
@pytest.mark.parametrize("rate", [0.0, 1.2])
def test_whatever_a_command_can_reach_is_looked_up_in_the_map(floor_with, robot, speed, rate):
    for distance in np.arange(0.3, 2.5, 0.2):
        arrays = floor_with(
            (distance, -2.0, 0.0, distance + 0.2, 2.0, 1.0),
            (-distance - 0.2, -2.0, 0.0, -distance, 2.0, 1.0),
        )
        command = Command(linear_m_s=speed, yaw_rate_rad_s=rate)
        everything = mapped_obstacles(arrays, robot, HERE, 4.5)
        assert filter_command(command, HERE, robot, arrays, 0.5) == filter_among(
            command, HERE, robot, everything, 0.5
        )


@pytest.mark.parametrize("acceleration", [0.4, 0.8, 2.0])
def test_little_more_than_a_command_can_reach_is_looked_up(monkeypatch, floor_with, acceleration):
    asked, robot = [], dataclasses.replace(ZED, max_linear_acceleration_m_s2=acceleration)

    def noted(arrays, robot, pose, radius_m):
        asked.append(radius_m)
        return mapped_obstacles(arrays, robot, pose, radius_m)

    monkeypatch.setattr("ippon.control.obstacles.mapped_obstacles", noted)
    filter_command(AHEAD, HERE, robot, floor_with(), 0.5)
    stopping_m = 0.8 * 0.5 + 0.5 * 0.8**2 / acceleration
    assert ZED.radius_m + stopping_m + 0.2 < asked[0] < ZED.radius_m + 2.0 * stopping_m + 0.31


@pytest.mark.parametrize("share", SHARES)
def test_a_share_of_a_command_is_taken_where_the_next_larger_one_is_not_free(share):
    speed = share * 0.8
    stopping_m = speed * HORIZON_S + 0.5 * speed**2 / ZED.max_linear_acceleration_m_s2
    post = np.array([[ZED.radius_m - OVERLAP_TOLERANCE_M + stopping_m + 0.001, 0.0]])
    command, _ = filter_among(AHEAD, HERE, ZED, post, HORIZON_S)
    assert command.linear_m_s == pytest.approx(speed)


@quick
@given(
    linear=st.floats(-0.8, 0.8),
    rate=st.floats(-1.2, 1.2),
    robot=st.sampled_from((ZED, LONG)),
)
def test_the_paths_that_are_checked_are_both_ways_to_stop(linear, rate, robot):
    x, y, yaw = 2.0, -3.0, 0.7
    command = Command(linear_m_s=linear, yaw_rate_rad_s=rate)
    together, *apart = _stopping_paths(command, np.array([x, y, yaw]), robot, HORIZON_S)
    stop_s = abs(linear) / robot.max_linear_acceleration_m_s2
    stop_turning_s = abs(rate) / robot.max_yaw_acceleration_rad_s2
    braking_s = stop_s if robot is ZED else max(stop_s, stop_turning_s)
    assert len(apart) == (linear != 0.0 and rate != 0.0 and stop_s != stop_turning_s)
    # The chord of an arc points to its middle heading.
    time_s = HORIZON_S + 0.5 * braking_s
    half = 0.5 * rate * time_s
    chord = linear * time_s * np.sinc(half / math.pi)
    end = (x + chord * math.cos(yaw + half), y + chord * math.sin(yaw + half), yaw + 2.0 * half)
    np.testing.assert_allclose(together[-1], end, atol=1e-9)
    for path in apart:
        steps = motion(command, (x, y, yaw), robot, HORIZON_S)
        last = min(len(steps), math.ceil(1e3 * (HORIZON_S + braking_s))) - 1
        np.testing.assert_allclose(path[-1], steps[last], atol=2e-3)
    for path, longest_s in ((together, time_s), *((path, time_s + braking_s) for path in apart)):
        steps = np.diff(np.vstack([(x, y, yaw), path]), axis=0)
        assert np.hypot(steps[:, 0], steps[:, 1]).max() <= 0.03 + 1e-9
        assert np.abs(steps[:, 2]).max() <= 0.1 + 1e-9
        fewest = max(abs(linear) / 0.03, abs(rate) / 0.1) * longest_s
        assert len(path) <= max(2.0, fewest + 1.0), "no more of them than that takes"


def test_a_robot_that_can_neither_drive_nor_turn_stands():
    posts = np.array([[0.33, 0.2141], [0.33, -0.2141]])
    command = Command(linear_m_s=0.8, yaw_rate_rad_s=1.2, tilt_rad=-0.2)
    safe, reason = filter_among(command, HERE, LONG, posts, HORIZON_S)
    assert safe == Command(tilt_rad=-0.2)
    assert reason == "stopped: obstacle 0.39 m ahead"


def test_obstacles_are_allowed_two_millimetres_closer_a_command():
    # Already 5 cm inside the body: the next command may cost 2 mm of that, not 3.
    for angle, moves in ((1.9e-3, True), (2.1e-3, False)):
        inside = np.array([[ZED.radius_m - 0.05, 0.0]])
        creep = Command(linear_m_s=angle / HORIZON_S)
        safe, _ = filter_among(creep, HERE, ZED, inside, HORIZON_S)
        assert (safe == creep) == moves


@pytest.mark.parametrize(("room", "passes"), [(-0.019, True), (-0.021, False)])
def test_two_centimetres_of_overlap_are_no_collision(room, passes):
    travelled = 0.4 * HORIZON_S + 0.5 * 0.4**2 / ZED.max_linear_acceleration_m_s2
    post = np.array([[ZED.radius_m + travelled + room, 0.0]])
    command = Command(linear_m_s=0.4)
    assert (filter_among(command, HERE, ZED, post, HORIZON_S)[1] is None) == passes


obstacle = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
scene = {
    "linear": st.floats(-0.8, 0.8),
    "rate": st.floats(-1.2, 1.2),
    "obstacles": st.lists(obstacle, min_size=1, max_size=6),
    "robot": st.sampled_from((ZED, HABITAT, LONG)),
}


@quick
@given(**scene, x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0), yaw=st.floats(-3.0, 3.0))
def test_where_the_robot_stands_and_heads_does_not_matter(
    linear, rate, obstacles, robot, x, y, yaw
):
    command, points = Command(linear_m_s=linear, yaw_rate_rad_s=rate), np.array(obstacles)
    pose = base_pose(x, y, 0.0, yaw)
    moved = points @ pose[:2, :2].T + (x, y)
    here, why = filter_among(command, HERE, robot, points + 1e-7, HORIZON_S)
    there, why_there = filter_among(command, pose, robot, moved + 1e-7, HORIZON_S)
    assert there.linear_m_s == pytest.approx(here.linear_m_s)
    assert there.yaw_rate_rad_s == pytest.approx(here.yaw_rate_rad_s)
    assert (why_there or "").partition(":")[0] == (why or "").partition(":")[0]


@quick
@given(**scene)
def test_the_mirrored_scene_gives_the_mirrored_command(linear, rate, obstacles, robot):
    points = np.array(obstacles)
    left, why = filter_among(
        Command(linear_m_s=linear, yaw_rate_rad_s=rate), HERE, robot, points, HORIZON_S
    )
    right, why_right = filter_among(
        Command(linear_m_s=linear, yaw_rate_rad_s=-rate), HERE, robot, points * (1, -1), HORIZON_S
    )
    assert right.linear_m_s == pytest.approx(left.linear_m_s)
    assert right.yaw_rate_rad_s == pytest.approx(-left.yaw_rate_rad_s)
    assert why_right == why


@quick
@given(**scene, another=obstacle)
def test_an_obstacle_more_never_makes_a_command_faster(linear, rate, obstacles, robot, another):
    command = Command(linear_m_s=linear, yaw_rate_rad_s=rate)
    few, _ = filter_among(command, HERE, robot, np.array(obstacles), HORIZON_S)
    more, _ = filter_among(
        command, HERE, robot, np.array([*obstacles, another]), HORIZON_S
    )
    assert abs(more.linear_m_s) <= abs(few.linear_m_s)


@quick
@given(**scene)
def test_a_filtered_command_is_a_share_of_the_wanted_one(linear, rate, obstacles, robot):
    command = Command(linear_m_s=linear, yaw_rate_rad_s=rate)
    points = np.array(obstacles)
    safe, why = filter_among(command, HERE, robot, points, HORIZON_S)
    assert (why is None) == (safe == command)
    if why is not None and why.startswith("slowed"):
        share = next(s for s in SHARES if why.startswith(f"slowed to {s:.0%}"))
        assert 0.0 < share < 1.0
        assert (safe.linear_m_s, safe.yaw_rate_rad_s) == (share * linear, share * rate)
    elif why is not None:
        assert why.startswith("stopped")
        assert safe.linear_m_s == 0.0
        assert safe.yaw_rate_rad_s in (0.0, rate)


@quick
@given(**scene)
def test_the_largest_share_that_is_free_is_taken(linear, rate, obstacles, robot):
    """Against the motion in steps of a millisecond, of the command's time and both ways to stop."""
    points = np.array(obstacles)
    start = body_clearance(robot, np.zeros((1, 3)), points)
    allowed = np.minimum(-OVERLAP_TOLERANCE_M, start - 0.002)

    def least_room(share: float) -> float:
        tried = Command(linear_m_s=share * linear, yaw_rate_rad_s=share * rate)
        ways = [motion(tried, (0.0, 0.0, 0.0), robot, HORIZON_S, apart) for apart in (False, True)]
        poses = np.concatenate(ways)
        return float((body_clearance(robot, poses, points) - allowed).min())

    command = Command(linear_m_s=linear, yaw_rate_rad_s=rate)
    safe, why = filter_among(command, HERE, robot, points, HORIZON_S)
    rooms = {share: least_room(share) for share in SHARES}
    # Samples are up to 3 cm apart: between two, a robot may get closer by a part of that, and
    # where one rate ends between two samples its path is a little another.
    assume(all(not -0.02 < room < 2e-3 for room in rooms.values()))
    free = [share for share, room in rooms.items() if room >= 0.0]
    if free:
        assert safe.linear_m_s == free[0] * linear
        assert safe.yaw_rate_rad_s == free[0] * rate
    else:
        assert why is not None
        assert why.startswith("stopped")
        assert safe.linear_m_s == 0.0


@pytest.mark.parametrize(
    ("command", "robot", "post", "where"),
    [
        (Command(linear_m_s=0.8), ZED, (0.3, 0.1), "0.32 m ahead"),
        (Command(linear_m_s=-0.8), ZED, (-0.3, 0.1), "0.32 m behind"),
        (Command(linear_m_s=0.3, yaw_rate_rad_s=1.2), ZED, (0.1, 0.26), "0.28 m beside"),
        (Command(yaw_rate_rad_s=1.2), LONG, (0.252, 0.36), "0.44 m beside"),
        (Command(yaw_rate_rad_s=1.2), LONG, (-0.252, -0.36), "0.44 m beside"),
    ],
)
@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (2.0, -3.0, 2.0), (-4.0, 1.0, -1.2)])
def test_the_reason_names_distance_and_side_of_what_is_in_the_way(
    command, robot, post, where, pose
):
    x, y, yaw = pose
    T_world_base = base_pose(x, y, 0.0, yaw)
    points = [post]
    if abs(command.linear_m_s) == 0.8:
        # Nearer, but on the other side.
        points.append((-np.sign(post[0]) * 0.26, 0.0))
    world = np.array(points) @ T_world_base[:2, :2].T + (x, y)
    _, reason = filter_among(command, T_world_base, robot, world, HORIZON_S)
    assert reason is not None
    assert reason.endswith(f"obstacle {where}")


def test_a_drop_stops_as_an_obstacle_does_and_is_named():
    edge = np.array([[0.5, 0.02 * k] for k in range(-20, 20)])
    as_obstacle, why = filter_among_hazards(AHEAD, HERE, ZED, Hazards(edge, NONE), HORIZON_S)
    as_drop, why_drop = filter_among_hazards(AHEAD, HERE, ZED, Hazards(NONE, edge), HORIZON_S)
    assert as_drop == as_obstacle != AHEAD
    assert "obstacle 0.50 m ahead" in why
    assert "drop 0.50 m ahead" in why_drop
    nearer = np.array([[0.4, 0.0]])
    _, why = filter_among_hazards(AHEAD, HERE, ZED, Hazards(nearer, edge), HORIZON_S)
    assert "obstacle 0.40 m ahead" in why, "the nearest is named"


def test_an_edge_of_the_floor_stops_the_robot(floor_with):
    for distance in (1.5, 1.0, 0.8, 0.6):
        arrays = floor_with(holes=[(distance, -2.0, distance + 2.0, 2.0)])
        at, command = HERE, AHEAD
        for _ in range(60):
            command, why = filter_command(AHEAD, at, ZED, arrays, 0.2)
            at = base_pose(at[0, 3] + 0.2 * command.linear_m_s, 0.0, 0.0, 0.0)
        assert command.linear_m_s == 0.0
        assert why.startswith("stopped: drop ")
        assert at[0, 3] + ZED.radius_m < distance
    back = Command(linear_m_s=-0.4)
    assert filter_command(back, at, ZED, arrays, 0.2) == (back, None), "it may leave the edge"
