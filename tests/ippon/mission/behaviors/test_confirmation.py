"""A search ends at its terminating viewpoint, with a find that is in reach."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.control.path_follower import PathFollower
from ippon.frame import Frame
from ippon.geometry import base_pose
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.behavior import StepContext
from ippon.mission.behaviors.confirmation import Confirmation
from ippon.mission.behaviors.pursuit import Pursuit
from ippon.mission.behaviors.step_closer import StepCloser
from ippon.mission.config import MissionConfig
from ippon.mission.finds.second_opinion import SecondOpinions
from ippon.mission.journal import Journal
from ippon.mission.search import Search
from ippon.mission.snapshot import Find, MissionState
from ippon.robot import ZED
from ippon.simulation.robot.mobile_base import camera_of


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
    voxel_map = robot.mission.voxel_map
    opinions = SecondOpinions(config.second_opinion)
    closer = StepCloser(config.step_closer, robot.mission._planner, ZED)
    confirmation = Confirmation(config, voxel_map, Journal(), opinions, robot.mission.rooms, closer)
    pursuit = Pursuit(config.travel_pitch, ZED, voxel_map)
    search = Search(goal, guidance, config)
    search.candidates = robot.last.candidates
    search.arrived_steps = config.confirm_steps + config.image_check.min_images + 2

    def act(frame, plan):
        step = StepContext(frame, 0.2, plan, search, follower, voxel_map)
        return confirmation.act(step) or pursuit.act(step)

    return robot, act, search


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


@pytest.mark.slow
def test_a_search_ends_where_its_viewpoint_is_and_not_on_the_way_to_another(before_a_bed):
    robot, act, search = before_a_bed
    plan, T_world_base = robot.last.plan, robot.last.T_world_base
    frame = frame_of(robot, T_world_base)
    x, y, z = plan.target.position_world
    elsewhere = dataclasses.replace(
        plan,
        target=dataclasses.replace(plan.target, position_world=(x - 1.3, y, z)),
        path_world=np.array([T_world_base[:3, 3], (x - 1.3, y, z)]),
    )
    pursued = act(frame, elsewhere)
    assert pursued.state is MissionState.APPROACHING
    assert search.find is None
    assert act(frame, plan).state is MissionState.FOUND
    assert search.find == dataclasses.replace(
        search.candidates[0], number=1, stamp_ns=frame.stamp_ns
    )


@pytest.mark.slow
def test_what_is_not_in_reach_is_not_found_by_a_plan_that_has_lost_it(before_a_bed):
    robot, act, search = before_a_bed
    T_world_base = robot.last.T_world_base
    nothing = dataclasses.replace(robot.last.plan, target=None)
    found = act(frame_of(robot, T_world_base), nothing)
    assert found.state is MissionState.FOUND, "one frame that does not see it changes nothing"
    search.find, search.arrived_steps = None, 20
    away = T_world_base.copy()
    away[0, 3] -= 0.8
    pursued = act(frame_of(robot, away), nothing)
    assert pursued.state is MissionState.SEARCHING
    assert search.find is None
    assert search.arrived_steps == 0


@pytest.mark.parametrize("floor_z_m", [0.0, 3.0])
def test_what_lies_on_another_storey_is_not_what_the_viewpoint_shows(floor_z_m):
    T_world_base = base_pose(1.0, 2.0, floor_z_m, 0.0)
    here, below, above = (
        Find(
            position_world=(1.6, 2.0, floor_z_m + up_m),
            size_m=(0.2, 0.2, 0.2),
            probability=0.9,
            voxels=voxels,
            box_px=box_px,
        )
        for up_m, voxels, box_px in (
            (0.5, 3, None),
            (-2.2, 40, (0, 0, 3, 3)),
            (3.4, 50, (0, 0, 3, 3)),
        )
    )
    config = MissionConfig()
    voxel_map = VoxelMap(config.map, ["bed"])
    rooms = SimpleNamespace(is_elsewhere=lambda *_: False)
    opinions = SecondOpinions(config.second_opinion)
    closer = StepCloser(config.step_closer, SimpleNamespace(), ZED)
    confirmation = Confirmation(config, voxel_map, Journal(), opinions, rooms, closer)
    chosen = SimpleNamespace(candidates=(above, below, here))
    step = SimpleNamespace(
        frame=SimpleNamespace(T_world_base=T_world_base),
        plan=SimpleNamespace(out_of_reach_m=None, ends_search=True),
    )
    assert confirmation._find_here(step, chosen) is here
