"""On the way to an object the camera stays on it; a search ends at its viewpoint, not before."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.control.path_follower import PathFollower
from ippon.frame import Frame
from ippon.geometry import wrap_angle, yaw_of
from ippon.mission.behaviors.pursuit import Pursuit
from ippon.mission.config import MissionConfig
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState
from ippon.robot import ZED
from ippon.simulation.robot.mobile_base import camera_of


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


@pytest.fixture
def before_a_bed(searcher, room):
    """A robot that stands where it found a bed, and what it needs to find it once more."""
    bed = ("bed", "bed", (4.0, 1.2, 0.0), (5.9, 3.0, 0.55))
    robot = searcher([*room(6.0, 4.5), bed], 1.0, 2.0)
    goal, guidance = robot.ask("bed")
    robot.search(60.0)
    assert robot.last.state is MissionState.FOUND
    config = MissionConfig()
    follower = PathFollower(config.follower, ZED)
    pursuit = Pursuit(config, ZED, follower, robot.mission.voxel_map)
    search = Search(goal, guidance, config)
    search.candidates = robot.last.candidates
    search.arrived_steps = config.confirm_steps + config.second_look.enough_images + 2
    return robot, pursuit, search


def frame_of(robot, T_world_base):
    tilt_rad = robot.last.plan.target.tilt_rad
    camera = camera_of(ZED, 32)
    return Frame(
        stamp_ns=robot.world.stamp_ns,
        color=np.zeros((camera.height, camera.width, 3), np.uint8),
        depth=np.full((camera.height, camera.width), np.nan, np.float32),
        camera=camera,
        T_world_camera=T_world_base @ ZED.T_base_camera(tilt_rad),
        T_world_base=T_world_base,
        tilt_rad=tilt_rad,
        heatmap=None,
        contact=False,
    )


def test_a_search_ends_where_its_viewpoint_is_and_not_on_the_way_to_another(before_a_bed):
    robot, pursuit, search = before_a_bed
    plan, T_world_base = robot.last.plan, robot.last.T_world_base
    frame = frame_of(robot, T_world_base)
    x, y, z = plan.target.position_world
    elsewhere = dataclasses.replace(
        plan,
        target=dataclasses.replace(plan.target, position_world=(x - 1.3, y, z)),
        path_world=np.array([T_world_base[:3, 3], (x - 1.3, y, z)]),
    )
    pursued = pursuit.step(search, frame, elsewhere, 0.2)
    assert pursued.state is MissionState.APPROACHING
    assert search.find is None
    assert pursuit.step(search, frame, plan, 0.2).state is MissionState.FOUND
    assert search.find is search.candidates[0]


def test_steps_without_time_neither_end_a_search_nor_count_for_its_going_on(before_a_bed):
    robot, pursuit, _ = before_a_bed
    idle_gain = MissionConfig().second_look.idle_gain
    nothing = dataclasses.replace(
        robot.last.plan, target=None, exhausted=True, promised_per_s=0.5 * idle_gain
    )
    open_yet = dataclasses.replace(nothing, exhausted=False, cut_short=True)
    search = SimpleNamespace(empty_steps=0, idle_steps=0)

    def counted(*plans):
        for plan in plans:
            pursuit._count(search, plan)
        return search.empty_steps, search.idle_steps

    assert counted(nothing, nothing) == (2, 2)
    assert counted(open_yet, open_yet) == (2, 2)
    assert counted(nothing) == (3, 3)
    assert counted(dataclasses.replace(nothing, exhausted=False)) == (0, 4)
    promising = dataclasses.replace(open_yet, promised_per_s=2.0 * idle_gain)
    assert counted(nothing, promising) == (1, 0)
    target = robot.last.plan.target
    assert counted(dataclasses.replace(promising, target=target)) == (0, 0)


def test_what_is_not_in_reach_is_not_found_by_a_plan_that_has_lost_it(before_a_bed):
    robot, pursuit, search = before_a_bed
    T_world_base = robot.last.T_world_base
    nothing = dataclasses.replace(robot.last.plan, target=None)
    found = pursuit.step(search, frame_of(robot, T_world_base), nothing, 0.2)
    assert found.state is MissionState.FOUND, "one frame that does not see it changes nothing"
    search.find, search.arrived_steps = None, 20
    away = T_world_base.copy()
    away[0, 3] -= 0.5
    pursued = pursuit.step(search, frame_of(robot, away), nothing, 0.2)
    assert pursued.state is MissionState.SEARCHING
    assert search.find is None
    assert search.arrived_steps == 0
