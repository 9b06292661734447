"""The operator sends the robot to a point, or drives it, while the search waits."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.control.drive_mode import DriveMode
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mapping.arrays import NOT_MAPPED
from ippon.mission.config import MissionConfig
from ippon.mission.goal import Goal
from ippon.mission.inspection import inspect_voxel
from ippon.mission.mission import Mission
from ippon.mission.snapshot import MissionState
from ippon.planning.visibility.region_weights import Stroke
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld
from ippon.vocabulary import MATTERPORT_40

CAMERA = PinholeCamera.from_horizontal_fov(192, 120, math.radians(74.0))
STEP_S = 0.2


@pytest.fixture(scope="module")
def scene():
    return generate_home(4)


@pytest.fixture
def world(scene):
    world = SimulatedWorld(scene, ZED, CAMERA, scene.start_poses[0], seed=0)
    world.set_labels(MATTERPORT_40, "toilet")
    return world


def guidance_of(context):
    return EmbeddedPrior().levels(resolve_object("toilet", MATTERPORT_40), context, MATTERPORT_40)


@pytest.fixture
def mission():
    mission = Mission(MissionConfig(), ZED, MATTERPORT_40, seed=0)
    resolved = resolve_object("toilet", MATTERPORT_40)
    mission.goals.set_goal(Goal.of(resolved, 1), guidance_of(""))
    return mission


def step(world, mission):
    result = mission.step(world.observe())
    world.step(result.command, STEP_S)
    return result


def at(world):
    x, y = world.T_world_base_estimated[:2, 3]
    return float(x), float(y)


@pytest.mark.slow
def test_goes_to_the_point_and_then_on_with_the_search(world, mission):
    for _ in range(25):
        step(world, mission)
    x, y = at(world)
    ways = [
        (mission.operator.go_to((x + r * math.cos(a), y + r * math.sin(a))), r, a)
        for r in (1.5, 1.0, 0.7)
        for a in (0.0, 1.6, 3.1, -1.6)
    ]
    way, r, a = next(entry for entry in ways if entry[0] is not None)
    assert way >= 0.0
    goal = (x + r * math.cos(a), y + r * math.sin(a))
    assert mission.operator.go_to(goal) is not None
    result = step(world, mission)
    assert result.snapshot.state is MissionState.MANUAL
    assert "going to your point" in result.snapshot.why
    texts = []
    for _ in range(80):
        texts += [event.text for event in step(world, mission).snapshot.events]
        if mission.operator.waypoint is None:
            break
    assert "at the point that you chose" in texts
    assert math.dist(at(world), goal) < 0.9, "at most the reach of a point on a table"
    assert step(world, mission).snapshot.state is not MissionState.MANUAL


@pytest.mark.parametrize("cancelled", [True, False])
def test_a_point_is_driven_to_with_the_full_margin_once_the_search_has_ended(
    world, mission, cancelled
):
    step(world, mission)
    floor = mission._planner._floor
    floor.relax()
    step(world, mission)
    assert floor.margin_m < floor.config.margin_m, "the search runs"
    if cancelled:
        mission.goals.cancel_goal()
    else:
        mission.search.end()
        step(world, mission)
    assert mission.operator.go_to(at(world)) is not None
    assert floor.margin_m == floor.config.margin_m


def test_a_point_beyond_the_map_has_no_way_and_changes_nothing(world, mission):
    assert mission.operator.go_to((0.0, 0.0)) is None, "there was no frame yet"
    step(world, mission)
    before = mission.state
    assert mission.operator.go_to((500.0, 500.0)) is None
    assert mission.operator.waypoint is None
    assert mission.state is before


def test_mapping_and_planning_continue_in_manual(world, mission):
    mission.operator.drive(DriveMode.MANUAL)
    first = step(world, mission)
    assert first.snapshot.state is MissionState.MANUAL
    assert [e.text for e in first.snapshot.events][-1] == "the operator drives"
    revision = mission.voxel_map.revision
    result = step(world, mission)
    assert (result.command.linear_m_s, result.command.yaw_rate_rad_s) == (0.0, 0.0)
    assert mission.voxel_map.revision > revision
    assert result.snapshot.plan is not None
    assert len(result.snapshot.plan.tree.parents) > 1
    mission.operator.drive(DriveMode.AUTO)
    result = step(world, mission)
    assert result.snapshot.state is MissionState.LOOKING_AROUND
    assert result.command.tilt_rad != 0.0 or result.command.yaw_rate_rad_s != 0.0


@pytest.mark.slow
def test_driving_by_hand_ends_the_way_to_a_point_and_never_counts_as_stuck(world, mission):
    for _ in range(12):
        step(world, mission)
    x, y = at(world)
    mission.operator.go_to((x, y))
    mission.operator.drive(DriveMode.ASSISTED)
    assert mission.operator.waypoint is None
    kinds = []
    for _ in range(20):  # The operator holds nothing: the robot stands for four seconds.
        result = mission.step(world.observe())
        world.step(None, STEP_S)
        kinds += [event.kind for event in result.snapshot.events]
    assert "contact" not in kinds


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "is_stuck"), [(1.0, True), (0.1, False)])
def test_at_a_speed_limit_it_takes_longer_to_count_as_stuck(world, mission, limit, is_stuck):
    mission.operator.limit_speed(limit)
    kinds = []
    for _ in range(22):
        result = mission.step(world.observe())
        world.step(Command(tilt_rad=result.command.tilt_rad), STEP_S)
        kinds += [event.kind for event in result.snapshot.events]
    assert ("contact" in kinds) is is_stuck


@pytest.mark.parametrize(
    ("mode", "text"),
    [
        (DriveMode.MANUAL, "blocked: marking what is ahead"),
        (DriveMode.AUTO, "blocked: marking what is ahead and backing off"),
    ],
)
def test_a_robot_that_is_driven_by_hand_is_not_said_to_back_off(world, mission, mode, text):
    mission.operator.drive(mode)
    result = mission.step(dataclasses.replace(world.observe(), contact=True))
    assert [e.text for e in result.snapshot.events if e.kind == "contact"] == [text]
    assert (result.command.linear_m_s < 0.0) is text.endswith("backing off")


def test_a_preview_changes_nothing(world, mission):
    assert mission.preview(guidance_of("")) is None, "there is no plan yet"
    result = [step(world, mission) for _ in range(12)][-1]
    before = mission.voxel_map.arrays().level.copy()
    target = result.snapshot.plan.target
    preview = mission.preview(guidance_of("it is next to the sofa"))
    assert preview is not None
    assert preview.before == target
    assert preview.then
    assert (mission.voxel_map.arrays().level == before).all()
    assert step(world, mission).snapshot.plan.target is not None

    arrays = mission.voxel_map.arrays()
    slab, cell = np.argwhere(arrays.level != NOT_MAPPED)[0]
    row = int(np.flatnonzero(arrays.slab == slab)[0])
    local = np.array([cell >> 6, (cell >> 3) & 7, cell & 7])
    voxel = mission.voxel_map.block_coords[row] * 8 + local
    report = inspect_voxel(mission.voxel_map, (voxel + 0.5) * arrays.voxel_size)
    assert report is not None
    assert report.labels, "the segmentation told"
    shares = [p for _, p in report.labels]
    assert shares == sorted(shares, reverse=True)
    assert 0.0 < sum(shares) <= 1.0 + 1e-6
    assert inspect_voxel(mission.voxel_map, np.array([900.0, 0.0, 0.0])) is None


def test_painting_takes_effect_with_the_next_plan(world, mission):
    plan = [step(world, mission) for _ in range(12)][-1].snapshot.plan
    x, y, _ = plan.target.position_world
    gone = Stroke(kind="not_here", points=((x, y),), radius_m=5.0)
    assert mission.operator.set_regions((gone,))
    after = step(world, mission).snapshot.plan
    assert after.tree.gains.max() < plan.tree.gains.max()
    assert mission.operator.set_regions(())
