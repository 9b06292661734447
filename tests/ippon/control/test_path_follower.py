"""Following a path: inside the limits, to the target, never through what appeared."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.control.obstacles import body_clearance, mapped_obstacles
from ippon.control.path_follower import FollowerConfig, PathFollower
from ippon.geometry import base_pose, wrap_angle
from ippon.guidance.levels import Level
from ippon.planning.plan import NodeKind, Plan, TreeView, Viewpoint
from ippon.planning.terrain.path_geometry import point_along, remaining_path
from ippon.robot import HABITAT, ZED
from tests.long_robot import LONG


def make_plan(points, yaw=0.0, tilt=-0.3) -> Plan:
    path = np.column_stack([np.array(points, dtype=float), np.zeros(len(points))])
    empty = np.zeros(0, dtype=np.float32)
    return Plan(
        target=Viewpoint(
            position_world=tuple(path[-1].tolist()),
            yaw_rad=yaw,
            tilt_rad=tilt,
            gain=1.0,
            termination=0.0,
            level=Level.AVERAGE,
            kind=NodeKind.EXPLORING,
            path_gain=1.0,
            path_cost_s=1.0,
        ),
        path_world=path,
        tree=TreeView(
            positions_world=np.zeros((0, 3), dtype=np.float32),
            parents=np.zeros(0, dtype=np.int32),
            yaws_rad=empty,
            tilts_rad=empty,
            gains=empty,
            terminations=empty,
            path_costs_s=empty,
            levels=np.zeros(0, dtype=np.uint8),
            kinds=np.zeros(0, dtype=np.uint8),
        ),
        exhausted=False,
        evaluated=0,
    )


def no_plan() -> Plan:
    plan = make_plan([(0.0, 0.0)])
    return Plan(
        target=None,
        path_world=np.zeros((0, 3)),
        tree=plan.tree,
        exhausted=True,
        evaluated=0,
    )


class Ride:
    """A robot that does exactly as told, with a tilt servo of limited rate."""

    def __init__(self, arrays, robot=ZED, pose=(0.0, 0.0, 0.0), dt=0.1, config=None):
        self.robot, self.arrays, self.dt = robot, arrays, dt
        self.follower = PathFollower(config or FollowerConfig(), robot)
        self.x, self.y, self.yaw = pose
        self.tilt = 0.0
        self.commands = []
        self.track = [(self.x, self.y, self.yaw)]

    def step(self, plan):
        pose = base_pose(self.x, self.y, 0.0, self.yaw)
        command = self.follower.step(plan, pose, self.tilt, self.arrays, self.dt)
        self.commands.append(command)
        for _ in range(10):
            t = self.dt / 10
            self.x += command.linear_m_s * t * math.cos(self.yaw)
            self.y += command.linear_m_s * t * math.sin(self.yaw)
            self.yaw = wrap_angle(self.yaw + command.yaw_rate_rad_s * t)
        most = self.robot.max_tilt_rate_rad_s * self.dt
        self.tilt += float(np.clip(command.tilt_rad - self.tilt, -most, most))
        self.track.append((self.x, self.y, self.yaw))
        return command

    def run(self, plan, seconds=30.0):
        for _ in range(round(seconds / self.dt)):
            self.step(plan)
            if self.follower.reached:
                return True
        return False


PATHS = [
    [(0.0, 0.0), (2.0, 0.0)],
    [(0.0, 0.0), (1.0, 0.0), (1.0, 1.5), (2.5, 1.5)],
    [(0.0, 0.0), (-1.5, 0.2)],
    [(0.0, 0.0), (0.05, 0.0)],
]


@pytest.mark.parametrize("robot", [ZED, HABITAT])
@pytest.mark.parametrize("dt", [0.05, 0.2])
@pytest.mark.parametrize("points", PATHS)
def test_the_robot_arrives_and_looks_where_it_should(floor_with, robot, dt, points):
    ride = Ride(floor_with(), robot, dt=dt)
    assert ride.run(make_plan(points, yaw=2.0, tilt=-0.4), 60.0)
    assert math.hypot(ride.x - points[-1][0], ride.y - points[-1][1]) < 0.13
    assert abs(wrap_angle(ride.yaw - 2.0)) < 0.12
    assert abs(ride.tilt + 0.4) < 0.12


@pytest.mark.parametrize("robot", [ZED, HABITAT])
@pytest.mark.parametrize("dt", [0.05, 0.2])
@pytest.mark.parametrize("points", PATHS)
def test_commands_stay_inside_velocity_and_acceleration_limits(floor_with, robot, dt, points):
    ride = Ride(floor_with(), robot, dt=dt)
    ride.run(make_plan(points, yaw=-2.5), 60.0)
    linear = np.array([0.0] + [c.linear_m_s for c in ride.commands])
    rate = np.array([0.0] + [c.yaw_rate_rad_s for c in ride.commands])
    assert np.abs(linear).max() <= robot.max_linear_m_s + 1e-9
    assert np.abs(rate).max() <= robot.max_yaw_rate_rad_s + 1e-9
    assert np.abs(np.diff(linear)).max() <= robot.max_linear_acceleration_m_s2 * dt + 1e-9
    assert np.abs(np.diff(rate)).max() <= robot.max_yaw_acceleration_rad_s2 * dt + 1e-9
    for command in ride.commands:
        assert robot.min_tilt_rad <= command.tilt_rad <= robot.max_tilt_rad


def test_the_robot_turns_on_the_spot_before_it_drives_the_other_way(floor_with):
    ride = Ride(floor_with())
    plan = make_plan([(0.0, 0.0), (-2.0, 0.0)], yaw=math.pi)
    while abs(wrap_angle(ride.yaw - math.pi)) > 1.0:
        ride.step(plan)
        assert math.hypot(ride.x, ride.y) < 0.02


@pytest.mark.parametrize("away", [0.09, 0.14])
def test_the_robot_does_not_turn_for_a_target_15_cm_away(floor_with, away):
    # The planner says so, too: else going to a target would make it dearer than another one.
    ride = Ride(floor_with(), HABITAT)
    plan = make_plan([(0.0, 0.0), (-away, 0.0)], yaw=0.7)
    assert ride.run(plan, 6.0)
    assert max(c.linear_m_s for c in ride.commands) == 0.0
    assert min(c.yaw_rate_rad_s for c in ride.commands) > -0.1, "straight to the final heading"


def test_a_robot_that_faces_the_target_drives_on_to_it(floor_with):
    ride = Ride(floor_with(), HABITAT)
    assert ride.run(make_plan([(0.0, 0.0), (0.14, 0.0)], yaw=0.7), 8.0)
    assert math.hypot(ride.x - 0.14, ride.y) < 0.1


def test_the_track_stays_near_the_path(floor_with):
    points = np.array([(0.0, 0.0), (1.5, 0.0), (1.5, 1.5), (3.0, 1.5)])
    ride = Ride(floor_with())
    assert ride.run(make_plan(points))
    dense = np.array([point_along(points, s) for s in np.arange(0.0, 4.6, 0.02)])
    track = np.array(ride.track)[:, :2]
    away = np.linalg.norm(track[:, None] - dense[None], axis=2).min(axis=1)
    assert away.max() < 0.2


def test_a_box_that_appeared_on_the_path_is_not_touched(floor_with):
    plan = make_plan([(0.0, 0.0), (3.0, 0.0)])
    ride = Ride(floor_with())
    for _ in range(12):
        ride.step(plan)
    assert ride.commands[-1].linear_m_s > 0.5
    distance = ride.x + 0.25 + 0.6
    ride.arrays = floor_with((round(distance, 1), -1.0, 0.0, round(distance, 1) + 0.2, 1.0, 0.6))
    for _ in range(60):
        ride.step(plan)
    assert ride.commands[-1].linear_m_s < 0.02
    obstacles = mapped_obstacles(ride.arrays, ZED, base_pose(ride.x, ride.y, 0, ride.yaw), 3.0)
    assert body_clearance(ZED, np.array(ride.track), obstacles).min() > -0.05


def test_corners_are_passed_with_room(floor_with):
    # The path cuts it fine round the corner of a wall; steering leaves more room than that.
    arrays = floor_with((0.4, 0.3, 0.0, 1.2, 2.5, 1.0))
    plan = make_plan([(0.0, 0.0), (1.5, 0.0), (1.5, 2.0)])
    obstacles = mapped_obstacles(arrays, ZED, base_pose(1.0, 1.0, 0.0, 0.0), 4.0)
    room = {}
    for weight in (0.0, 8.0):
        ride = Ride(arrays, config=FollowerConfig(side_weight=weight))
        assert ride.run(plan, 60.0)
        room[weight] = body_clearance(ZED, np.array(ride.track), obstacles).min()
    assert room[8.0] >= room[0.0]
    assert room[8.0] > -0.02


def test_without_a_target_the_robot_comes_to_rest(floor_with):
    ride = Ride(floor_with())
    plan = make_plan([(0.0, 0.0), (5.0, 0.0)])
    for _ in range(15):
        ride.step(plan)
    for _ in range(15):
        command = ride.step(no_plan())
    assert command.linear_m_s == command.yaw_rate_rad_s == 0.0
    assert command.tilt_rad == pytest.approx(ride.tilt)
    assert not ride.follower.reached


def test_a_robot_too_close_to_something_drives_away_from_it(floor_with):
    arrays = floor_with((-0.4, -1.0, 0.0, -0.2, 1.0, 1.0))
    ride = Ride(arrays)
    assert ride.run(make_plan([(0.0, 0.0), (1.5, 0.0)]))


def test_what_is_left_of_a_path():
    path = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    left = remaining_path(path, 0.5, 0.1)
    np.testing.assert_allclose(left, [(0.5, 0.1), (1.0, 0.0), (1.0, 1.0)])
    left = remaining_path(path, 1.1, 0.4)
    np.testing.assert_allclose(left, [(1.1, 0.4), (1.0, 1.0)])
    np.testing.assert_allclose(point_along(path, 1.25), [1.0, 0.25])
    np.testing.assert_allclose(point_along(path, 9.0), [1.0, 1.0])


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"go_on_rad": 0.9}, "angles must grow"),
        ({"lookahead_m": 0.0}, "must be positive"),
        ({"braking_share": 0.0}, "must lie in"),
    ],
)
def test_tolerances_that_never_settle_are_refused(values, text):
    with pytest.raises(ValueError, match=text):
        FollowerConfig(**values)


def test_a_long_robot_backs_out_of_where_it_cannot_turn(floor_with):
    corridor = [(-1.0, y, 0.0, 2.0, y + 0.2, 1.0) for y in (-0.5, 0.3)]
    arrays = floor_with(*corridor)
    plan = make_plan([(1.0, 0.0), (-1.8, 0.0), (-1.8, 1.0)], yaw=math.pi / 2)
    ride = Ride(arrays, LONG, (1.0, 0.0, 0.0))
    assert ride.run(plan, 30.0)
    inside = [(c, t) for c, t in zip(ride.commands, ride.track, strict=False) if t[0] > -1.0]
    assert min(c.linear_m_s for c, _ in inside) < -0.3
    assert max(c.linear_m_s for c, _ in inside) <= 0.0, "backwards only"
    assert max(abs(yaw) for _, (_, _, yaw) in inside) < 0.2, "it does not turn in there"
    poses = np.array(ride.track)
    obstacles = mapped_obstacles(arrays, LONG, base_pose(0.0, 0.0, 0.0, 0.0), 4.0)
    assert body_clearance(LONG, poses, obstacles).min() > -0.02


def on_a_gangway(floor_with):
    """A way 0.8 m wide, along which LONG fits and on which it cannot turn."""
    return floor_with(holes=[(-2.0, -2.4, 2.0, -0.4), (-2.0, 0.4, 2.0, 2.4)])


def test_a_long_robot_backs_off_a_gangway_that_it_cannot_turn_on(floor_with):
    plan = make_plan([(1.0, 0.0), (-3.0, 0.0), (-3.0, 1.0)], yaw=math.pi / 2)
    ride = Ride(on_a_gangway(floor_with), LONG, (1.0, 0.0, 0.0))
    assert ride.run(plan, 40.0)
    on_it = [(c, t) for c, t in zip(ride.commands, ride.track, strict=False) if t[0] > -1.5]
    assert max(c.linear_m_s for c, _ in on_it) <= 0.0, "backwards only"
    assert max(abs(yaw) for _, (_, _, yaw) in on_it) < 0.2
    round_one = Ride(on_a_gangway(floor_with), ZED, (1.0, 0.0, 0.0))
    assert round_one.run(make_plan([(1.0, 0.0), (-3.0, 0.0)], yaw=math.pi), 40.0)
    assert min(c.linear_m_s for c in round_one.commands) >= 0.0, "a round one turns"


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_long_robot_turns_as_far_as_the_planner_has_seen_the_floor(floor_with, side):
    plan = make_plan([(0.0, 0.0), (-2.0, 0.02 * side)], yaw=math.pi)
    free = (0.5, math.pi) if side > 0.0 else (math.pi, 0.5)

    def first(plan):
        ride = Ride(floor_with(), LONG)
        ride.run(plan, 2.0)
        return ride.commands[-1]

    assert first(plan).linear_m_s == 0.0, "it turns"
    assert first(dataclasses.replace(plan, free_turn_rad=free)).linear_m_s == 0.0
    other = free[::-1]
    assert first(dataclasses.replace(plan, free_turn_rad=other)).linear_m_s < -0.2


def test_a_round_robot_turns_in_the_same_corridor(floor_with):
    corridor = [(-1.0, y, 0.0, 2.0, y + 0.2, 1.0) for y in (-0.5, 0.3)]
    ride = Ride(floor_with(*corridor), ZED, (1.0, 0.0, 0.0))
    assert ride.run(make_plan([(1.0, 0.0), (-1.8, 0.0)], yaw=math.pi), 30.0)
    assert min(c.linear_m_s for c in ride.commands) >= 0.0


def test_a_long_robot_follows_a_path_through_a_narrow_door(floor_with):
    door = [(1.0, -2.0, 0.0, 1.2, -0.4, 1.0), (1.0, 0.4, 0.0, 1.2, 2.0, 1.0)]
    arrays = floor_with(*door)
    ride = Ride(arrays, LONG, (-1.0, -1.0, 1.0))
    plan = make_plan([(-1.0, -1.0), (0.2, 0.0), (2.0, 0.0), (2.0, 1.0)], yaw=0.0)
    assert ride.run(plan, 40.0)
    obstacles = mapped_obstacles(arrays, LONG, base_pose(1.0, 0.0, 0.0, 0.0), 4.0)
    assert body_clearance(LONG, np.array(ride.track), obstacles).min() > -0.03


def test_a_long_robot_turns_round_where_it_has_the_room(floor_with):
    ride = Ride(floor_with(), LONG)
    assert ride.run(make_plan([(0.0, 0.0), (-2.0, 0.0)], yaw=math.pi), 30.0)
    assert min(c.linear_m_s for c in ride.commands) >= 0.0


def test_a_robot_that_cannot_reverse_turns(floor_with):
    corridor = [(-1.0, y, 0.0, 2.0, y + 0.2, 1.0) for y in (-0.5, 0.3)]
    ride = Ride(floor_with(*corridor), dataclasses.replace(LONG, can_reverse=False))
    ride.run(make_plan([(0.0, 0.0), (-1.8, 0.0)], yaw=math.pi), 5.0)
    assert min(c.linear_m_s for c in ride.commands) >= 0.0


def test_a_target_is_reached_with_a_camera_that_sticks(floor_with):
    follower, plan = PathFollower(FollowerConfig(), ZED), make_plan([(3.0, 3.0)], tilt=-0.8)
    arrays, T_world_base = floor_with(), base_pose(3.0, 3.0, 0.0, 0.0)
    steps = 0
    while not follower.reached and steps < 100:
        follower.step(plan, T_world_base, -0.2, arrays, 0.2)
        steps += 1
    assert 0.2 * steps == pytest.approx(5.9, abs=0.5), "after all that its tilt could take"
    away = base_pose(2.0, 3.0, 0.0, 0.0)
    follower.step(make_plan([(2.0, 3.0), (3.0, 3.0)]), away, -0.2, arrays, 0.2)
    follower.step(plan, T_world_base, -0.2, arrays, 0.2)
    assert not follower.reached, "it is awaited at each target"
