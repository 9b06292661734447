"""What stands near the robot at the height of its body."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.camera import PinholeCamera
from ippon.control.obstacles import (
    body_clearance,
    disc_clearance,
    mapped_obstacles,
    nearest_distance,
    observed_obstacles,
)
from ippon.frame import Frame
from ippon.geometry import base_pose
from ippon.mapping.arrays import OCCUPIED
from ippon.planning.terrain.obstacle_columns import HeightBands
from ippon.robot import ZED, CollisionSphere, RobotProfile
from tests.long_robot import LONG
from tests.reference import obstacles as plain
from tests.reference.planning_floor import state_of

HERE = base_pose(0.0, 0.0, 0.0, 0.0)


def test_the_floor_is_no_obstacle_and_a_box_is(floor_with):
    assert len(mapped_obstacles(floor_with(), ZED, HERE, 2.0)) == 0
    found = mapped_obstacles(floor_with((1.0, -0.2, 0.0, 1.2, 0.2, 0.5)), ZED, HERE, 2.0)
    assert found.shape == (8, 2)
    assert found[:, 0].min() == pytest.approx(1.05)
    assert len(mapped_obstacles(floor_with((1.0, -0.2, 1.3, 1.2, 0.2, 1.5)), ZED, HERE, 2.0)) == 0


@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_looking_at_every_column(floor_with, seed):
    rng = np.random.default_rng(seed)
    boxes = []
    for _ in range(8):
        low = rng.random(3) * (6.0, 6.0, 1.2) - (3.0, 3.0, 0.0)
        boxes.append((*low, *(low + 0.1 + rng.random(3) * 0.5)))
    arrays = floor_with(*boxes)
    x, y = rng.random(2) - 0.5
    bands = HeightBands.of(ZED, 0.0, 0.1)
    expected = set()
    for i in range(-25, 25):
        for j in range(-25, 25):
            cx, cy = (i + 0.5) * 0.1, (j + 0.5) * 0.1
            layers = range(bands.body_low, bands.body_high + 1)
            if np.hypot(cx - x, cy - y) <= 1.6 and any(
                state_of(arrays, i, j, k) == OCCUPIED for k in layers
            ):
                expected.add((round(cx, 3), round(cy, 3)))
    found = mapped_obstacles(arrays, ZED, base_pose(x, y, 0.0, 1.0), 1.6)
    assert {tuple(p) for p in found.round(3).tolist()} == expected


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.04, -0.03), (-0.31, 0.26)])
@pytest.mark.parametrize("radius_m", [0.45, 0.5, 1.0])
def test_every_column_within_the_radius_is_listed(floor_with, x, y, radius_m):
    arrays = floor_with((-3.0, -3.0, 0.0, 3.0, 3.0, 1.0))
    cells = (np.arange(-30, 30) + 0.5) * 0.1
    centres = np.array([(cx, cy) for cx in cells for cy in cells])
    away = np.hypot(*(centres - (x, y)).T)
    expected = centres[away <= radius_m - 1e-9]
    found = mapped_obstacles(arrays, ZED, base_pose(x, y, 0.0, 0.0), radius_m)
    on_border = np.abs(away - radius_m).min() < 1e-9
    assert len(found) == len(expected) or on_border
    assert {tuple(p) for p in expected.round(3).tolist()} <= {
        tuple(p) for p in found.round(3).tolist()
    }


def test_the_lowest_and_the_highest_layer_of_the_body_count(floor_with):
    bands = HeightBands.of(ZED, 0.0, 0.1)
    for layer, counts in (
        (bands.body_low - 1, False),
        (bands.body_low, True),
        (bands.body_high, True),
        (bands.body_high + 1, False),
    ):
        low, high = 0.1 * layer, 0.1 * (layer + 1)
        found = mapped_obstacles(floor_with((1.0, 0.0, low, 1.1, 0.1, high)), ZED, HERE, 2.0)
        assert len(found) == counts


def test_room_is_infinite_without_obstacles():
    assert np.isinf(nearest_distance(np.zeros((3, 2)), np.zeros((0, 2)))).all()
    room = nearest_distance(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[3.0, 4.0], [1.0, 1.0]]))
    np.testing.assert_allclose(room, [np.sqrt(2.0), 1.0])


def test_a_long_robot_has_less_room_sideways_when_it_turns():
    spheres = tuple(
        CollisionSphere(x_m=x, y_m=0.0, z_m=0.3, radius_m=0.2) for x in (-0.3, 0.0, 0.3)
    )
    robot = RobotProfile(
        name="dog",
        spheres=spheres,
        max_linear_m_s=0.5,
        max_yaw_rate_rad_s=1.0,
        max_tilt_rate_rad_s=1.0,
    )
    post = np.array([[0.0, 0.6]])
    along, across = np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, np.pi / 2]])
    assert body_clearance(robot, along, post)[0] == pytest.approx(0.4)
    assert body_clearance(robot, across, post)[0] == pytest.approx(0.1)


def looking_at(distance_m, rows=slice(None), columns=slice(None)):
    """A frame of the level camera at `HERE`: something upright at a distance, the rest far."""
    camera = PinholeCamera.from_horizontal_fov(160, 100, ZED.horizontal_fov_rad)
    depth = np.full((100, 160), 4.5, dtype=np.float32)
    depth[rows, columns] = distance_m
    return Frame(
        stamp_ns=0,
        color=np.zeros((100, 160, 3), dtype=np.uint8),
        depth=depth,
        camera=camera,
        T_world_camera=HERE @ ZED.T_base_camera(0.0),
        T_world_base=HERE,
        tilt_rad=0.0,
    )


def test_what_one_image_shows_is_where_it_is():
    found = observed_obstacles(looking_at(0.9, columns=slice(70, 90)), ZED, 0.1, 2.0)
    np.testing.assert_allclose(found[:, 0], 0.9, atol=1e-6)
    half = 0.9 * np.tan(0.5 * ZED.horizontal_fov_rad) * 10.5 / 80
    assert -half <= found[:, 1].min() < -0.03
    assert 0.03 < found[:, 1].max() <= half


def test_depth_nearer_than_the_camera_measures_is_no_obstacle():
    far_sighted = dataclasses.replace(ZED, min_depth_m=1.0)
    near = looking_at(0.9, columns=slice(70, 90))
    assert len(observed_obstacles(near, ZED, 0.1, 2.0)) > 0
    assert len(observed_obstacles(near, far_sighted, 0.1, 2.0)) == 0


def test_one_image_shows_no_obstacle_above_below_beyond_or_inside_the_body():
    above, below = slice(0, 40), slice(95, 100)
    assert len(observed_obstacles(looking_at(1.5, rows=above), ZED, 0.1, 2.0)) == 0
    assert len(observed_obstacles(looking_at(2.7, rows=below), ZED, 0.1, 3.0)) == 0, "the floor"
    assert len(observed_obstacles(looking_at(2.1), ZED, 0.1, 2.0)) == 0
    assert len(observed_obstacles(looking_at(0.15), ZED, 0.1, 2.0)) == 0, "the robot itself"
    assert (
        len(observed_obstacles(looking_at(0.9, slice(60, 61), slice(80, 83)), ZED, 0.1, 2.0)) == 0
    ), "three pixels may be errors"


def test_what_stands_beside_a_long_robot_is_not_the_robot_itself():
    frame = looking_at(0.4, columns=slice(60, 100))
    assert len(observed_obstacles(frame, LONG, 0.1, 2.0)) == 0, "within its nose"
    aside = base_pose(0.0, 0.0, 0.0, np.pi / 2)
    turned = dataclasses.replace(
        frame, T_world_base=aside, T_world_camera=HERE @ ZED.T_base_camera(0.0)
    )
    assert len(observed_obstacles(turned, LONG, 0.1, 2.0)) > 0, "beside its flank"


@pytest.mark.parametrize("robot", [ZED, LONG])
@pytest.mark.parametrize(("height", "width", "step"), [(100, 160, 2), (60, 100, 1), (61, 100, 2)])
def test_agrees_with_looking_at_every_pixel(robot, height, width, step):
    rng = np.random.default_rng(height)
    x, y, yaw = 3.0 * rng.random(3) - 1.5
    base = base_pose(x, y, 0.4, yaw)
    camera = PinholeCamera.from_horizontal_fov(width, height, ZED.horizontal_fov_rad)
    # Patches of 6 x 6 pixels at all distances that matter, and without a return.
    patches = rng.choice([0.0, 0.2, 0.31, 0.5, 0.8, 1.2, 1.6, 2.0, 4.0], (17, 27))
    depth = np.kron(patches, np.ones((6, 6)))[:height, :width]
    depth = (depth * (1.0 + 0.02 * rng.random(depth.shape))).astype(np.float32)
    frame = Frame(
        stamp_ns=0,
        color=np.zeros((height, width, 3), dtype=np.uint8),
        depth=depth,
        camera=camera,
        T_world_camera=base @ robot.T_base_camera(-0.4),
        T_world_base=base,
        tilt_rad=-0.4,
    )
    expected = plain.observed(frame, robot, 0.1, 1.7, step)
    assert len(expected) > 20
    found = sorted(map(tuple, observed_obstacles(frame, robot, 0.1, 1.7).tolist()))
    np.testing.assert_allclose(found, expected, atol=1e-6)


numbers = st.floats(-3.0, 3.0)
points = st.lists(st.tuples(numbers, numbers), min_size=1, max_size=4)
poses = st.lists(st.tuples(numbers, numbers, numbers), min_size=1, max_size=4)


@settings(max_examples=30)
@given(poses=poses, obstacles=points, robot=st.sampled_from((ZED, LONG)))
def test_room_is_that_of_the_nearest_sphere_at_the_nearest_pose(poses, obstacles, robot):
    spheres = [(s.x_m, s.y_m, s.radius_m) for s in robot.spheres]
    expected = [min(plain.room(spheres, pose, one) for pose in poses) for one in obstacles]
    found = body_clearance(robot, np.array(poses), np.array(obstacles))
    np.testing.assert_allclose(found, expected, atol=1e-9)
    outline = list(robot.outline)
    expected = [min(plain.room(outline, pose, one) for one in obstacles) for pose in poses]
    found = disc_clearance(robot.outline, np.array(poses), np.array(obstacles))
    np.testing.assert_allclose(found, expected, atol=1e-9)
