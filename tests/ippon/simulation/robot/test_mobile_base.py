import dataclasses
import math

import numpy as np
import pytest

from ippon.command import Command
from ippon.robot import HABITAT, ZED, CollisionSphere
from ippon.simulation.robot.mobile_base import BaseConfig, SimulatedBase
from ippon.simulation.scene import StartPose

FORWARD = Command(linear_m_s=10.0)


@pytest.fixture
def room(make_scene, room_boxes):
    return make_scene(room_boxes())


def base_in(scene, x=1.0, y=2.0, yaw=0.0, robot=ZED, **config):
    return SimulatedBase(scene, robot, StartPose(x=x, y=y, z=0.0, yaw=yaw), BaseConfig(**config))


def test_speed_and_acceleration_keep_their_limits(room):
    base = base_in(room)
    speeds, turns = [0.0], [0.0]
    for _ in range(100):
        base.step(Command(linear_m_s=10.0, yaw_rate_rad_s=10.0), 0.02)
        speeds.append(base.linear_m_s)
        turns.append(base.yaw_rate_rad_s)
    assert max(speeds) == ZED.max_linear_m_s
    assert max(turns) == ZED.max_yaw_rate_rad_s
    assert np.diff(speeds).max() <= ZED.max_linear_acceleration_m_s2 * 0.02 + 1e-12
    assert np.diff(turns).max() <= ZED.max_yaw_acceleration_rad_s2 * 0.02 + 1e-12


def test_a_circle_is_driven_as_its_radius_says(room):
    base = base_in(room, x=2.5, y=1.5)
    command = Command(linear_m_s=0.4, yaw_rate_rad_s=0.8)
    for _ in range(10):
        base.step(command, 0.1)
    points = []
    for _ in range(80):
        base.step(command, 0.1)
        points.append((base.x_m, base.y_m))
    points = np.array(points)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    assert np.linalg.norm(points - centre, axis=1) == pytest.approx(0.5, abs=0.01)


def test_long_steps_are_the_same_as_short_ones(furnished):
    long, short = base_in(furnished, x=2.0, y=0.6), base_in(furnished, x=2.0, y=0.6)
    rng = np.random.default_rng(0)
    for _ in range(30):
        command = Command(linear_m_s=0.8, yaw_rate_rad_s=rng.uniform(-1.2, 1.2))
        long.step(command, 0.2)
        short.step(command, 0.02)
        for _ in range(9):
            short.step(None, 0.02)
        assert (long.x_m, long.y_m, long.yaw_rad) == pytest.approx(
            (short.x_m, short.y_m, short.yaw_rad), abs=1e-9
        )


def test_the_camera_tilts_at_its_rate_to_its_limits(room):
    base = base_in(room)
    for tilt, limit in ((-9.0, ZED.min_tilt_rad), (9.0, ZED.max_tilt_rad)):
        before = base.tilt_rad
        base.step(Command(tilt_rad=tilt), 0.1)
        assert abs(base.tilt_rad - before) == pytest.approx(ZED.max_tilt_rate_rad_s * 0.1)
        for _ in range(30):
            base.step(Command(tilt_rad=tilt), 0.1)
        assert base.tilt_rad == limit


def test_a_robot_at_full_speed_stops_half_a_second_after_the_last_command(room):
    base = base_in(room, command_timeout_s=0.25)
    base.linear_m_s, base.yaw_rate_rad_s = ZED.max_linear_m_s, ZED.max_yaw_rate_rad_s
    base.step(Command(linear_m_s=ZED.max_linear_m_s, yaw_rate_rad_s=ZED.max_yaw_rate_rad_s), 0.02)
    for _ in range(25):
        base.step(None, 0.02)
    assert (base.linear_m_s, base.yaw_rate_rad_s) == (0.0, 0.0)


def test_without_commands_it_stops_after_timeout_and_braking(room):
    base = base_in(room)
    for _ in range(10):
        base.step(Command(linear_m_s=0.4, yaw_rate_rad_s=0.3), 0.1)
    assert base.linear_m_s == 0.4
    for _ in range(4):
        base.step(None, 0.1)
    assert base.linear_m_s > 0.0
    braking_s = 0.4 / (base.config.brake_factor * ZED.max_linear_acceleration_m_s2)
    for _ in range(math.ceil(braking_s / 0.1)):
        base.step(None, 0.1)
    assert (base.linear_m_s, base.yaw_rate_rad_s) == (0.0, 0.0)
    x = base.x_m
    base.step(None, 1.0)
    assert base.x_m == x
    base.step(FORWARD, 0.1)
    assert base.linear_m_s > 0.0


def test_commands_act_after_the_latency(room):
    base = base_in(room, latency_s=0.3)
    base.step(FORWARD, 0.1)
    base.step(None, 0.2)
    assert base.linear_m_s == 0.0
    base.step(None, 0.1)
    assert base.linear_m_s > 0.0


def test_head_on_it_stops_at_the_wall_and_says_so(room):
    for sliding in (True, False):
        base = base_in(room, sliding=sliding)
        for _ in range(60):
            base.step(FORWARD, 0.1)
        assert base.x_m == pytest.approx(4.75, abs=0.02)
        assert base.x_m <= 4.7502
        assert base.contact
        assert base.collisions == 1
        base.step(Command(linear_m_s=-0.5), 0.5)
        assert not base.contact
        assert base.x_m < 4.7


def test_sliding_follows_the_wall_and_stopping_does_not(room):
    sliding, stopping = (
        base_in(room, x=4.0, y=1.0, yaw=math.radians(50.0), sliding=on) for on in (True, False)
    )
    for _ in range(40):
        for base in (sliding, stopping):
            base.step(FORWARD, 0.1)
    assert sliding.y_m > stopping.y_m + 0.5
    assert stopping.contact
    assert stopping.x_m <= 4.7502
    assert sliding.x_m <= 4.7502


def test_it_never_enters_furniture_however_it_is_driven(furnished):
    rng = np.random.default_rng(4)
    for sliding in (True, False):
        base = base_in(furnished, sliding=sliding)
        hits = 0
        for k in range(400):
            if k % 10 == 0:
                drive, turn = rng.uniform(-0.8, 0.8), rng.uniform(-1.0, 1.0)
            command = Command(linear_m_s=drive, yaw_rate_rad_s=turn)
            base.step(command, 0.2)
            depth = base._contacts.deepest(base.x_m, base.y_m, base.yaw_rad).depth_m
            assert depth <= 2e-4
            hits += base.contact
        assert hits > 5


def test_placed_in_contact_it_can_drive_away_but_not_in(room):
    base = base_in(room, x=4.80)
    base.step(FORWARD, 0.5)
    assert base.x_m <= 4.8 + 1e-6
    assert base.contact
    base.step(Command(linear_m_s=-0.8), 1.0)
    assert base.x_m < 4.7


def test_a_drop_stops_it_like_a_wall(make_scene):
    scene = make_scene([("floor", "floor", (0.0, 0.0, -0.1), (3.0, 3.0, 0.0))])
    base = base_in(scene, x=1.0, y=1.5)
    for _ in range(60):
        base.step(FORWARD, 0.1)
    assert 2.5 < base.x_m < 3.0
    assert base.contact


def test_stairs_up_stop_it(make_scene, room_boxes):
    steps = [
        ("stairs", "step", (3.0 + 0.3 * k, 1.0, 0.0), (3.3 + 0.3 * k, 3.0, 0.18 * (k + 1)))
        for k in range(4)
    ]
    base = base_in(make_scene([*room_boxes(), *steps]))
    for _ in range(60):
        base.step(FORWARD, 0.1)
    assert base.x_m < 3.0
    assert base.z_m == 0.0


def test_a_long_body_cannot_turn_into_a_wall(room):
    long = dataclasses.replace(
        ZED,
        spheres=(
            CollisionSphere(x_m=0.4, y_m=0.0, z_m=0.4, radius_m=0.2),
            CollisionSphere(x_m=-0.4, y_m=0.0, z_m=0.4, radius_m=0.2),
        ),
    )
    base = base_in(room, x=2.5, y=3.6, robot=long)
    for _ in range(30):
        base.step(Command(yaw_rate_rad_s=1.0), 0.1)
    assert 0.0 < base.yaw_rad < 1.2
    assert base.contact


def test_a_base_that_cannot_reverse_does_not(room):
    base = base_in(room, robot=HABITAT)
    base.step(Command(linear_m_s=-0.3), 0.5)
    assert base.x_m == 1.0


def test_bad_commands_and_durations_are_refused(room):
    base = base_in(room)
    with pytest.raises(ValueError, match="finite numbers"):
        base.step(Command(linear_m_s=math.nan), 0.1)
    for dt in (0.0, -1.0, math.inf):
        with pytest.raises(ValueError, match="positive, finite number of seconds"):
            base.step(FORWARD, dt)
    with pytest.raises(ValueError, match="tick_s must be positive"):
        BaseConfig(tick_s=0.0)
