"""Whole searches in a generated home: frames in, commands out, no processes."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.control.drive_mode import DriveMode
from ippon.control.obstacles import body_clearance, mapped_obstacles
from ippon.errors import FrameRejectedError
from ippon.evaluation.episode import EpisodeLimits, run_episode
from ippon.evaluation.metrics import Judge
from ippon.geometry import base_pose, yaw_of
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.levels import Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.behaviors.behavior import Action
from ippon.mission.behaviors.config import LookAroundConfig
from ippon.mission.config import MissionConfig
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.mission.snapshot import MissionState
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld
from ippon.vocabulary import MATTERPORT_40

CAMERA = PinholeCamera.from_horizontal_fov(192, 120, math.radians(74.0))
LIMITS = EpisodeLimits(max_time_s=240.0)
HOME = 4


@pytest.fixture(scope="module")
def scene():
    return generate_home(HOME)


def start(scene, seed=0):
    world = SimulatedWorld(scene, ZED, CAMERA, scene.start_poses[0], seed=seed)
    return world, Mission(MissionConfig(), ZED, MATTERPORT_40, seed=seed)


def ask(mission, text, context="", goal_id=1):
    resolved = resolve_object(text, MATTERPORT_40)
    guidance = EmbeddedPrior().levels(resolved, context, MATTERPORT_40)
    mission.goals.set_goal(Goal.of(resolved, goal_id, context), guidance)
    return guidance


def looked_around(scene, text):
    """Return a world and a mission that has just looked around for something."""
    world, mission = start(scene)
    ask(mission, text)
    world.set_labels(MATTERPORT_40, text)
    mission.step(world.observe())
    mission._behaviors.look_around.skip()
    return world, mission


def search(world, mission):
    results = list(run_episode(world, mission, LIMITS))
    assert results, "an episode has at least one step"
    return results


@pytest.mark.slow
def test_finds_two_objects_in_a_row_on_one_map(scene) -> None:
    world, mission = start(scene)
    ask(mission, "toilet")
    first = search(world, mission)
    assert first[-1].snapshot.state is MissionState.FOUND
    assert Judge(scene, ZED, "toilet").is_success(world.trajectory[-1])
    states = [r.snapshot.state for r in first]
    assert states[0] is MissionState.LOOKING_AROUND
    assert MissionState.APPROACHING in states
    find = first[-1].snapshot.find
    assert find is not None
    assert find.box_px is not None, "the object is in view at the end"

    revision = mission.voxel_map.revision
    known = mission.voxel_map.explored_m2()
    ask(mission, "sofa", goal_id=2)
    second = search(world, mission)
    assert mission.voxel_map.revision > revision
    # A cell that was free may be seen to hold something.
    assert second[0].snapshot.explored_m2 >= 0.999 * known, "it starts on the first map"
    later = [r.snapshot.state for r in second[1:]]
    assert MissionState.LOOKING_AROUND not in later, "the map has the sofa already"
    assert second[-1].snapshot.state is MissionState.FOUND
    assert Judge(scene, ZED, "sofa").is_success(world.trajectory[-1])


def test_the_planner_knows_the_height_of_every_frame_also_without_a_goal(scene, monkeypatch):
    world, mission = start(scene)
    heights = []
    monkeypatch.setattr(mission._planner, "note_height", heights.append)
    frames = [world.observe(), world.observe()]
    mission.step(frames[0])
    mission.observe(frames[1])
    assert heights == [float(frame.T_world_base[2, 3]) for frame in frames]


def test_looks_around_again_for_another_object_but_not_for_the_same_one(scene) -> None:
    world, mission = looked_around(scene, "sofa")
    ask(mission, "sofa", "it is in the living room", goal_id=2)
    mission.step(world.observe())
    assert mission.state is MissionState.SEARCHING, "nothing more to see from here"
    mission.goals.cancel_goal()
    ask(mission, "sofa", goal_id=3)
    assert mission.state is MissionState.SEARCHING
    for goal_id in (4, 5):
        ask(mission, "hat", goal_id=goal_id)
        assert mission.state is MissionState.STARTING, "no image is remembered for a hat"
        world.set_labels(MATTERPORT_40, "hat")
        mission.step(world.observe())
        assert mission.state is MissionState.LOOKING_AROUND
        mission._behaviors.look_around.skip()


def test_looks_around_again_for_the_same_object_somewhere_else(scene) -> None:
    world, mission = looked_around(scene, "sofa")
    # The search is over, and somebody else drives.
    mission.search.state = MissionState.FOUND
    for _ in range(8):
        world.step(Command(linear_m_s=0.5), 0.2)
        mission.step(world.observe())
    gone = np.linalg.norm(world.trajectory[-1] - world.trajectory[0])
    assert gone > LookAroundConfig().same_place_m, "the start pose has room ahead"
    ask(mission, "sofa", goal_id=2)
    assert mission.state is MissionState.STARTING


@pytest.mark.slow
def test_a_rejected_find_is_not_found_again(scene) -> None:
    world, mission = start(scene)
    ask(mission, "bed")
    first = search(world, mission)[-1].snapshot
    assert first.find is not None
    assert mission.goals.confirm_find()
    assert mission.goals.reject_find()
    assert not mission.goals.confirm_find()
    assert not mission.goals.reject_find(), "there is nothing left to reject"
    assert mission.state is MissionState.SEARCHING
    again = list(run_episode(world, mission, EpisodeLimits(max_time_s=20.0)))[-1].snapshot
    if again.find is not None:
        apart = np.subtract(again.find.position_world[:2], first.find.position_world[:2])
        assert np.hypot(*apart) > 0.5


def test_a_find_without_voxels_can_be_rejected_too(scene) -> None:
    world, mission = start(scene)
    ask(mission, "sofa")
    for _ in run_episode(world, mission, EpisodeLimits(max_time_s=2.0)):
        pass
    # Its voxels have gone meanwhile.
    mission.search.state = MissionState.FOUND
    revision = mission.voxel_map.revision
    assert mission.goals.reject_find()
    assert mission.voxel_map.revision > revision, "what it looked at is ruled out"
    assert mission.state is MissionState.SEARCHING
    assert not mission.goals.reject_find()
    mission.search.state = MissionState.FOUND
    assert mission.goals.confirm_find()
    mission.goals.cancel_goal()
    kinds = [e.kind for e in mission.step(world.observe()).snapshot.events]
    assert "cancelled" not in kinds, "it was found; that stays so"


@pytest.mark.slow
def test_two_runs_of_one_seed_are_the_same_run(scene) -> None:
    runs = []
    for _ in range(2):
        world, mission = start(scene, seed=5)
        ask(mission, "plant")
        steps = list(run_episode(world, mission, EpisodeLimits(max_time_s=12.0)))
        runs.append(([s.command for s in steps], world.trajectory))
    assert runs[0][0] == runs[1][0]
    assert np.array_equal(runs[0][1], runs[1][1])


def test_a_stopped_robot_stands_until_it_is_resumed(scene) -> None:
    world, mission = start(scene)
    ask(mission, "hat")
    world.set_labels(MATTERPORT_40, "hat")
    mission.step(world.observe())
    mission.operator.stop()
    mission.operator.pause()
    for _ in range(3):
        result = mission.step(world.observe())
        assert result.snapshot.state is MissionState.STOPPED, "a pause does not weaken a stop"
        assert result.command.linear_m_s == result.command.yaw_rate_rad_s == 0.0
        world.step(result.command, 0.2)
    mission.operator.resume()
    result = mission.step(world.observe())
    assert result.snapshot.state is MissionState.LOOKING_AROUND
    assert [e.kind for e in result.snapshot.events] == ["resumed"]


def test_a_pause_and_a_stop_after_it_are_told_once_each(scene) -> None:
    world, mission = start(scene)
    ask(mission, "hat")
    for hold in (mission.operator.pause, mission.operator.stop):
        hold()
        hold()
    events = mission.step(world.observe()).snapshot.events
    told = [e.text for e in events if e.kind == "stopped"]
    assert told == ["paused by the operator", "stopped by the operator"]


def test_without_a_goal_it_maps_and_waits(scene) -> None:
    world, mission = start(scene)
    world.set_labels(MATTERPORT_40, None)
    result = mission.step(world.observe())
    assert result.snapshot.why == "waiting for a goal"
    assert result.snapshot.goal is None
    assert mission.voxel_map.bounds() is not None, "the map grows all the same"
    assert not mission.goals.reject_find()
    with pytest.raises(ValueError, match="set a goal first"):
        mission.goals.set_guidance(EmbeddedPrior().levels("hat", "", MATTERPORT_40))


def test_levels_of_another_vocabulary_are_refused(scene) -> None:
    _, mission = start(scene)
    guidance = EmbeddedPrior().levels("hat", "", MATTERPORT_40[:10])
    with pytest.raises(ValueError, match="guidance speaks of 10 labels, the map of 40"):
        mission.goals.set_goal(Goal(goal_id=1, object="hat", display="hat"), guidance)


def test_a_changed_level_recolours_the_map(scene) -> None:
    world, mission = start(scene)
    guidance = ask(mission, "hat")
    for result in run_episode(world, mission, EpisodeLimits(max_time_s=2.0)):
        assert result.snapshot.goal is not None
    arrays = mission.voxel_map.arrays()
    before = arrays.level[arrays.level != 255].copy()
    rows = tuple(dataclasses.replace(row, level=Level.FAR) for row in guidance.rows)
    mission.goals.set_guidance(dataclasses.replace(guidance, rows=rows))
    after = mission.voxel_map.arrays().level
    assert len(before)
    assert set(np.unique(after[after != 255])) == {Level.FAR}


def test_a_frame_without_any_depth_changes_nothing(scene) -> None:
    world, mission = start(scene)
    ask(mission, "hat")
    frame = world.observe()
    mission.step(frame)
    revision = mission.voxel_map.revision
    nothing = np.full_like(frame.depth, np.nan)
    with pytest.raises(FrameRejectedError):
        mission.step(dataclasses.replace(frame, stamp_ns=frame.stamp_ns + 1, depth=nothing))
    assert mission.voxel_map.revision == revision


def test_a_reset_of_the_clock_does_not_change_the_age_of_a_search(scene) -> None:
    world, mission = start(scene)
    ask(mission, "hat")
    frame = world.observe()
    for stamp_s, elapsed_s in ((500, 0.0), (503, 3.0), (2, 3.0), (4, 5.0)):
        result = mission.step(dataclasses.replace(frame, stamp_ns=stamp_s * 1_000_000_000))
        assert result.snapshot.elapsed_s == pytest.approx(elapsed_s)


@pytest.mark.parametrize(("period_ms", "counted"), [(500, 8), (200, 20), (100, 20), (50, 20)])
def test_patience_in_steps_is_that_of_five_a_second(scene, monkeypatch, period_ms, counted) -> None:
    world, mission = start(scene)
    ask(mission, "hat")
    told: list[bool] = []
    monkeypatch.setattr(mission._planner, "set_searching", lambda _, *, counts: told.append(counts))
    monkeypatch.setattr(mission._behaviors, "act", lambda step: Action(step.hold))
    frame, begun_ns = world.observe(), 7_000_000_000
    mission.observe(frame)

    def run(from_ms, to_ms):
        told.clear()
        for ms in range(from_ms, to_ms, period_ms):
            mission.decide(dataclasses.replace(frame, stamp_ns=begun_ns + ms * 1_000_000))
        return sum(told)

    assert run(0, 4_000) in (counted, counted + 1), "one more for images that come unevenly"
    mission.operator.drive(DriveMode.MANUAL)
    assert run(4_000, 5_000) == 0
    mission.operator.drive(DriveMode.AUTO)
    assert run(0, 4_000) == counted, "also after a reset of the robot's clock"


def test_a_map_that_reaches_its_bound_says_so_once(scene, monkeypatch) -> None:
    world, mission = start(scene)
    integrate = mission.voxel_map.integrate
    events = []
    for dropped in (0, 7, 9):
        monkeypatch.setattr(
            mission.voxel_map,
            "integrate",
            lambda frame, n=dropped: dataclasses.replace(integrate(frame), blocks_dropped=n),
        )
        events.append([e.text for e in mission.step(world.observe()).snapshot.events])
    assert "reached its bound of 1024 MB" in " ".join(events[1])
    assert not any("bound" in text for text in events[0] + events[2])


@pytest.mark.slow
def test_backing_off_stops_at_a_wall_that_the_map_knows(scene) -> None:
    world, mission = start(scene)
    ask(mission, "hat")
    for _ in run_episode(world, mission, EpisodeLimits(max_time_s=10.0)):
        pass
    frame = world.observe()
    obstacles = mapped_obstacles(mission.voxel_map.arrays(), ZED, frame.T_world_base, 4.0)
    x, y = obstacles[np.hypot(*(obstacles - frame.T_world_base[:2, 3]).T).argmin()]
    heading = math.atan2(y - frame.T_world_base[1, 3], x - frame.T_world_base[0, 3])
    # The robot stands with its back to the wall, all but touching it, when something touches it.
    away = ZED.radius_m + 0.005
    pose = base_pose(
        x - away * math.cos(heading), y - away * math.sin(heading), 0.0, heading + math.pi
    )
    frame = dataclasses.replace(
        frame, stamp_ns=frame.stamp_ns + 200_000_000, T_world_base=pose, contact=True
    )
    result = mission.decide(frame)
    room = body_clearance(ZED, path_of(result.command, pose), obstacles)
    assert room.min() > -0.025
    assert "; s" in result.snapshot.why, "the operator reads why the robot holds back"
    assert "obstacle" in result.snapshot.why


def path_of(command, T_world_base, duration_s=0.2):
    """Return poses (N, 3) along a straight command."""
    t = np.linspace(0.0, duration_s, 20)
    yaw = yaw_of(T_world_base)
    x = T_world_base[0, 3] + t * command.linear_m_s * math.cos(yaw)
    y = T_world_base[1, 3] + t * command.linear_m_s * math.sin(yaw)
    return np.column_stack([x, y, np.full_like(t, yaw)])
