"""How the operator's hand becomes a command, and that no hand drives into a wall."""

import math

import numpy as np
import pytest

from ippon.command import Command
from ippon.control.drive_mode import (
    NO_INPUT,
    DriveMode,
    TeleopInput,
    blend_commands,
    follows_plan,
    scale_command,
)
from ippon.control.obstacles import hazards_around
from ippon.control.safety_filter import filter_among_hazards
from ippon.robot import HABITAT, ZED
from ippon.simulation.robot.mobile_base import SimulatedBase
from ippon.simulation.scene import Instance, Scene, StartPose

PLANNED = Command(linear_m_s=0.6, yaw_rate_rad_s=0.3, tilt_rad=-0.4)
SEVERAL = 1000
HELD_S = 0.3
TICK_S = 0.05


def test_auto_is_the_planner_whatever_is_held():
    assert blend_commands(DriveMode.AUTO, TeleopInput(forward=-1.0), PLANNED, ZED) == PLANNED


@pytest.mark.parametrize("mode", [DriveMode.ASSISTED, DriveMode.MANUAL])
def test_the_robot_stands_without_an_input(mode):
    command = blend_commands(mode, NO_INPUT, PLANNED, ZED)
    assert (command.linear_m_s, command.yaw_rate_rad_s) == (0.0, 0.0)


def test_assisted_forward_goes_the_planners_way_at_the_operators_pace():
    hand = TeleopInput(forward=0.5)
    assert follows_plan(DriveMode.ASSISTED, hand)
    assert blend_commands(DriveMode.ASSISTED, hand, PLANNED, ZED) == scale_command(PLANNED, 0.5)


@pytest.mark.parametrize(
    "hand", [TeleopInput(turn=1.0), TeleopInput(forward=1.0, turn=-0.5), TeleopInput(forward=-1.0)]
)
def test_assisted_turning_and_backing_are_the_operators_own(hand):
    assert not follows_plan(DriveMode.ASSISTED, hand)
    command = blend_commands(DriveMode.ASSISTED, hand, PLANNED, ZED)
    assert command == blend_commands(DriveMode.MANUAL, hand, PLANNED, ZED)
    assert command.linear_m_s == hand.forward * ZED.max_linear_m_s
    assert command.yaw_rate_rad_s == hand.turn * ZED.max_yaw_rate_rad_s


def test_a_robot_that_cannot_reverse_does_not():
    assert not HABITAT.can_reverse
    command = blend_commands(DriveMode.MANUAL, TeleopInput(forward=-1.0), PLANNED, HABITAT)
    assert command.linear_m_s == 0.0


def test_more_than_the_robot_can_do_is_refused():
    with pytest.raises(ValueError, match="lies in -1 to 1; got TeleopInput"):
        TeleopInput(forward=1.5)
    with pytest.raises(ValueError, match="lies in -1 to 1"):
        TeleopInput(turn=math.nan)


def _room_scene(boxes) -> Scene:
    """A scene of boxes (low corner, high corner) on a floor."""
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], dtype=bool)
    vertices = [np.where(pick, high, low) for low, high in boxes]
    count = len(boxes)
    return Scene(
        name="boxes",
        source="test",
        instances=tuple(
            Instance(node=f"b{k}", category="wall", label="wall", aabb_min=low, aabb_max=high)
            for k, (low, high) in enumerate(boxes)
        ),
        start_poses=(StartPose(x=0.0, y=0.0, z=0.0, yaw=0.0),),
        rooms=(),
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=np.concatenate([faces + 8 * k for k in range(count)]).astype(np.int32),
        face_instance=np.repeat(np.arange(count), len(faces)).astype(np.int32),
        face_colors=np.full((count * len(faces), 3), 128, dtype=np.uint8),
    )


@pytest.mark.slow
@pytest.mark.parametrize("robot", [ZED, HABITAT], ids=lambda robot: robot.name)
def test_a_thousand_random_commands_at_walls_touch_nothing(floor_with, robot):
    """The map knows walls to half a voxel; the hand jumps from one extreme to another."""
    walls = [
        (-1.6, -1.6, 0.0, -1.4, 1.6, 2.0), (1.4, -1.6, 0.0, 1.6, 1.6, 2.0),
        (-1.6, -1.6, 0.0, 1.6, -1.4, 2.0), (-1.6, 1.4, 0.0, 1.6, 1.6, 2.0),
        (0.7, 0.6, 0.0, 1.0, 0.9, 1.0), (-1.0, -0.2, 0.0, -0.7, 0.0, 0.6),
    ]  # fmt: skip
    arrays = floor_with(*walls)
    floor = ((-3.0, -3.0, -0.1), (3.0, 3.0, 0.0))
    scene = _room_scene([floor, *(((a, b, c), (d, e, f)) for a, b, c, d, e, f in walls)])
    base = SimulatedBase(scene, robot, scene.start_poses[0])
    rng = np.random.default_rng(7)
    margin = 0.5 * arrays.voxel_size + 0.03
    stopped = 0
    travelled = 0.0
    for _ in range(SEVERAL):
        forward, turn = (
            rng.choice([-1.0, 0.0, 0.4, 1.0, 1.0]),
            rng.choice([-1.0, -0.3, 0, 0, 0.3, 1]),
        )
        wanted = blend_commands(
            DriveMode.MANUAL,
            TeleopInput(forward=float(forward), turn=float(turn)),
            Command(),
            robot,
        )
        for _ in range(round(HELD_S / TICK_S)):
            here = base.T_world_base
            hazards = hazards_around(arrays, robot, here, 2.5)
            safe, reason = filter_among_hazards(wanted, here, robot, hazards, 0.3, margin, 1e-6)
            stopped += reason is not None
            before = (base.x_m, base.y_m)
            base.step(safe, TICK_S)
            travelled += math.dist(before, (base.x_m, base.y_m))
    assert base.collisions == 0
    assert stopped > SEVERAL / 10, "the walls are in the way all the time"
    assert travelled > 3.0, "a robot that stands touches nothing either"
