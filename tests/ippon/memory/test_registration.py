"""A robot that stands somewhere in a home that was mapped from other places."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import (
    R_BASE_CAMERA_LEVEL,
    invert_transform,
    make_transform,
    rotation_z,
    transform_points,
    yaw_of,
)
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.memory.registration import (
    RegistrationConfig,
    RegistrationError,
    register,
    seen_points,
    surface_points,
)
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.robot.mobile_base import camera_of
from ippon.simulation.world import SimulatedWorld, WorldConfig
from ippon.vocabulary import MATTERPORT_40

HOME = 4201
VIEWS = 9


def views(scene, pose, count, seed):
    """Frames of a turn at a pose, in the home's own frame, with noisy depth."""
    frames = []
    world = SimulatedWorld(scene, ZED, camera_of(ZED, 120), pose, seed, WorldConfig())
    for k in range(count):
        world.base.yaw_rad = pose.yaw + 2.0 * math.pi * k / count
        world.step(None, 0.2)
        frames.append(world.observe())
    return frames


@pytest.fixture(scope="module")
def home():
    return generate_home(HOME)


@pytest.fixture(scope="module")
def yesterday(home):
    """The map of a robot that was in every room."""
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=256.0), MATTERPORT_40)
    stamp_ns = 0
    for pose in home.start_poses[:12]:
        for frame in views(home, pose, 8, seed=1):
            stamp_ns += 100_000_000_000
            voxel_map.integrate(dataclasses.replace(frame, stamp_ns=stamp_ns))
    return voxel_map


def in_own_frame(frames, T_home_own):
    """Points in the frame that the robot has today, as far as it trusts its depth."""
    points = np.concatenate([seen_points(frame, 6.0) for frame in frames])
    return transform_points(invert_transform(T_home_own), points)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("where", "yaw", "shift"),
    [
        (0, 0.0, (0.0, 0.0, 0.0)),
        (3, 2.5, (4.0, -7.0, 0.0)),
        (7, -1.2, (-30.0, 12.0, 0.3)),
        (5, 3.1, (0.4, 0.3, -0.2)),
    ],
)
def test_a_robot_with_another_frame_finds_its_place(home, yesterday, where, yaw, shift):
    T_home_own = make_transform(rotation_z(yaw), shift)
    points = in_own_frame(views(home, home.start_poses[where], VIEWS, seed=7), T_home_own)
    found = register(points, -shift[2], surface_points(yesterday), 0.0)
    error = T_home_own @ invert_transform(found.T_map_world)
    at = np.array([home.start_poses[where].x, home.start_poses[where].y, 0.0])
    moved_m = float(np.linalg.norm(transform_points(error, at[None])[0] - at))
    assert moved_m < 0.15, "one and a half voxels"
    assert abs(math.degrees(yaw_of(error))) < 1.5
    assert found.fitness > 0.9
    assert found.rmse_m < 0.1
    assert found.T_map_world[2, 2] == 1.0, "upright"


@pytest.mark.slow
def test_a_robot_in_another_home_is_told_so(home, yesterday):
    other = generate_home(HOME + 1)
    points = in_own_frame(views(other, other.start_poses[2], VIEWS, seed=7), np.eye(4))
    with pytest.raises(RegistrationError, match=r"fits nowhere in the map|several places"):
        register(points, 0.0, surface_points(yesterday), 0.0)


def room(x=6.0, y=4.0, cell=0.1):
    """The walls of an empty room from (0, 0), as points."""
    z = np.arange(0.3, 1.9, cell)
    along_x, along_y = np.arange(0.0, x, cell), np.arange(0.0, y, cell)
    walls = [
        [(a, b, c) for a in along_x for b in (0.0, y) for c in z],
        [(a, b, c) for a in (0.0, x) for b in along_y for c in z],
    ]
    return np.array([point for wall in walls for point in wall])


@pytest.mark.slow
def test_places_that_look_alike_are_not_chosen_between():
    with pytest.raises(RegistrationError, match="several places in the map fit"):
        register(room() @ rotation_z(0.5).T, 0.0, room(), 0.0)


@pytest.mark.slow
def test_a_pillar_tells_the_two_ends_of_a_room_apart():
    corner, side = (5.0, 3.0, 0.3), np.arange(0.0, 0.8, 0.1)
    grid = np.meshgrid(side, side, np.arange(0.0, 1.6, 0.1), indexing="ij")
    pillar = np.stack(grid, axis=-1).reshape(-1, 3) + corner
    everything = np.concatenate([room(), pillar])
    config = RegistrationConfig(min_lead=0.05)
    found = register(everything @ rotation_z(0.7).T + (2.0, 1.0, 0.0), 0.0, everything, 0.0, config)
    assert math.degrees(yaw_of(found.T_map_world)) == pytest.approx(-40.1, abs=1.0)


@pytest.mark.parametrize(("seen", "name"), [(True, "in the map"), (False, "in view")])
def test_too_little_is_said(seen, name):
    clouds = [room(), np.zeros((3, 3))]
    points, surface = clouds if seen else clouds[::-1]
    with pytest.raises(RegistrationError, match=f"too little is {name}"):
        register(points, 0.0, surface, 0.0)


def test_the_points_of_a_frame_are_where_its_depth_says(make_frame):
    frame = make_frame(2.0)
    points = seen_points(frame, 6.0)
    assert points[:, 0] == pytest.approx(2.0)
    assert points[:, 2].mean() == pytest.approx(1.0, abs=0.1)
    assert len(seen_points(frame, 1.5)) == 0


@pytest.fixture
def make_frame():
    def make(depth_m):
        return Frame(
            stamp_ns=0,
            color=np.zeros((48, 64, 3), np.uint8),
            depth=np.full((48, 64), depth_m, np.float32),
            camera=PinholeCamera.from_horizontal_fov(64, 48, 1.2),
            T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0)),
            T_world_base=np.eye(4),
            tilt_rad=0.0,
        )

    return make


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"yaw_steps": 2}, "yaw_steps is at least 4"),
        ({"lowest_m": 3.0}, "lowest_m below highest_m"),
        ({"min_fitness": 0.0}, r"min_fitness lies in \(0, 1\]"),
    ],
)
def test_nonsense_is_refused(fields, text):
    with pytest.raises(ValueError, match=text):
        RegistrationConfig(**fields)
