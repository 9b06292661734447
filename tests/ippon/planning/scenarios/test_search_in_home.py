"""The loop closed: a simulated home, the map, the planner and the follower."""

import functools
import math

import numpy as np
import pytest

from ippon.command import Command
from ippon.control.path_follower import FollowerConfig, PathFollower
from ippon.guidance.levels import Level, LevelProbabilities
from ippon.mapping.voxel_map import MapConfig, VoxelMap
from ippon.planning.config import PlannerConfig
from ippon.planning.plan import NodeKind
from ippon.planning.planner import ViewpointPlanner
from ippon.robot import HABITAT, ZED
from ippon.simulation.robot.mobile_base import camera_of
from ippon.simulation.scene import Instance, Scene, StartPose
from ippon.simulation.world import SimulatedWorld, WorldConfig
from ippon.vocabulary import MATTERPORT_40

DT = 0.2


def _box(low, high):
    """Twelve triangles of an axis-aligned box."""
    corners = np.array(
        [[(low, high)[b >> n & 1][n] for n in range(3)] for b in range(8)], dtype=np.float32
    )
    quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return corners, np.array(faces, dtype=np.int32)


def home(*, toilet: bool = True) -> Scene:
    """Two rooms of 4 x 4 m joined by a door of 0.9 m; the toilet stands in the far corner."""
    parts = [
        ("floor", (-4.1, -2.1, -0.1), (4.1, 2.1, 0.0)),
        ("ceiling", (-4.1, -2.1, 2.5), (4.1, 2.1, 2.6)),
        ("wall", (-4.1, -2.1, 0.0), (-4.0, 2.1, 2.5)),
        ("wall", (4.0, -2.1, 0.0), (4.1, 2.1, 2.5)),
        ("wall", (-4.0, -2.1, 0.0), (4.0, -2.0, 2.5)),
        ("wall", (-4.0, 2.0, 0.0), (4.0, 2.1, 2.5)),
        ("wall", (-0.05, -2.0, 0.0), (0.05, 0.3, 2.5)),
        ("wall", (-0.05, 1.2, 0.0), (0.05, 2.0, 2.5)),
        ("sofa", (-3.9, -1.9, 0.0), (-2.2, -1.1, 0.8)),
        ("table", (1.2, -0.6, 0.0), (2.0, 0.2, 0.7)),
    ]
    if toilet:
        parts.append(("toilet", (3.3, -1.9, 0.0), (3.8, -1.4, 0.8)))
    vertices, faces, owner, instances = [], [], [], []
    for row, (category, low, high) in enumerate(parts):
        v, f = _box(low, high)
        faces.append(f + 8 * row)
        vertices.append(v)
        owner += [row] * len(f)
        instances.append(
            Instance(
                node=f"{category}.{row}",
                category=category,
                label=category,
                aabb_min=low,
                aabb_max=high,
            )
        )
    colors = np.full((len(owner), 3), 180, dtype=np.uint8)
    return Scene(
        name="two rooms",
        source="test",
        instances=tuple(instances),
        start_poses=(StartPose(x=-2.5, y=0.5, z=0.0, yaw=2.0),),
        rooms=(),
        vertices=np.concatenate(vertices),
        faces=np.concatenate(faces),
        face_instance=np.array(owner, dtype=np.int32),
        face_colors=colors,
    )


def search(scene, robot, goal="toilet", steps=700):
    """Look around, then follow the planner; returns the outcome, the world and all commands."""
    camera = camera_of(robot, 160)
    world = SimulatedWorld(
        scene, robot, camera, scene.start_poses[0], seed=1, config=WorldConfig.perfect()
    )
    world.set_labels(MATTERPORT_40, goal)
    voxels = VoxelMap(MapConfig(), MATTERPORT_40)
    voxels.set_ooi(goal)
    probabilities = LevelProbabilities().as_array()
    voxels.set_levels(np.full(40, Level.AVERAGE, dtype=np.uint8), probabilities)
    planner = ViewpointPlanner(PlannerConfig(), robot, 3)
    planner.set_goal(probabilities=probabilities, termination_min=6.0)
    follower = PathFollower(FollowerConfig(), robot)
    turned, commands, touched = 0.0, [], False
    for _ in range(steps):
        frame = world.observe()
        voxels.integrate(frame)
        if frame.contact and not touched:
            planner.mark_contact(frame.T_world_base)
        touched = frame.contact
        arrays = voxels.arrays()
        plan = planner.step(arrays, frame.T_world_base, frame.tilt_rad)
        terminating = plan.target is not None and plan.target.kind is NodeKind.TERMINATING
        command = follower.step(plan, frame.T_world_base, frame.tilt_rad, arrays, DT)
        if turned < 2.0 * math.pi:
            command = Command(yaw_rate_rad_s=robot.max_yaw_rate_rad_s, tilt_rad=-0.4)
            turned += robot.max_yaw_rate_rad_s * DT
        elif terminating and follower.reached:
            return "found", world, commands
        elif plan.exhausted:
            return "exhausted", world, commands
        commands.append(command)
        world.step(command, DT)
    return "time", world, commands


def distance_to(scene, category, world) -> float:
    boxes = [i for i in scene.instances if i.category == category]
    return min(
        math.hypot(
            max(i.aabb_min[0] - world.base.x_m, 0.0, world.base.x_m - i.aabb_max[0]),
            max(i.aabb_min[1] - world.base.y_m, 0.0, world.base.y_m - i.aabb_max[1]),
        )
        for i in boxes
    )


@pytest.fixture(scope="module")
def first():
    """Return outcome, world and commands of a search in the home, made once for each robot."""
    return functools.cache(lambda robot: search(home(), robot))


@pytest.mark.slow
@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_the_object_in_the_other_room_is_found(first, robot):
    scene = home()
    outcome, world, _ = first(robot)
    assert outcome == "found"
    assert distance_to(scene, "toilet", world) <= 1.0
    assert world.collisions <= 1
    # The way there is 7 m; wandering through both rooms several times would be a failure.
    assert world.path_length_m() < 20.0


@pytest.mark.slow
def test_a_home_without_the_object_is_exhausted():
    outcome, world, _ = search(home(toilet=False), ZED)
    assert outcome == "exhausted"
    assert world.trajectory[:, 0].max() > 0.5, "the other room was visited"


@pytest.mark.slow
def test_two_searches_of_one_seed_are_the_same(first):
    _, world, commands = first(ZED)
    _, again, repeated = search(home(), ZED)
    assert repeated == commands
    np.testing.assert_array_equal(again.trajectory, world.trajectory)
