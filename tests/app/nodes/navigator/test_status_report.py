import time
from types import SimpleNamespace

import pytest

from app.messages.driving import DriveStatus
from app.messages.lease import LeaseStatus
from app.messages.status import CountedFind, GoalStatus
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.frame_intake import Stopwatch
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.status_report import (
    PLAN_WINDOW,
    StatusReport,
    elapsed_s_of,
    with_room,
)
from ippon.command import Command
from ippon.mission.config import MissionConfig
from ippon.mission.mission import Mission
from ippon.planning.config import PlannerConfig
from ippon.robot import ZED
from ippon.vocabulary import MATTERPORT_40


def state_of(
    report, mission, *, lost=(), notes=(), frames=0, refused="", ended="", camera="",
    localization="",
):  # fmt: skip
    intake = SimpleNamespace(
        frames=frames,
        refused=refused,
        camera_refused=camera,
        ended=ended,
        monitors={},
        assembler=SimpleNamespace(missing=lambda: "camera info"),
    )
    return report.status(
        None,
        mission,
        goals=GoalQueue(1),
        intake=intake,
        watch=Stopwatch(),
        lost=lost,
        drive=DriveStatus(),
        lease=LeaseStatus(),
        notes=notes,
        localization=localization,
    )


@pytest.fixture(scope="module")
def mission():
    return Mission(MissionConfig(), ZED, MATTERPORT_40, seed=0)


def test_stopped_is_shown_before_the_first_frame_too(report, mission):
    assert state_of(report, mission).state == "starting"
    assert state_of(report, mission).why == "waiting for the robot's camera info"
    refused = state_of(report, mission, camera="it is distorted").why
    assert refused == "camera info is refused: it is distorted"
    mission.operator.stop()
    assert state_of(report, mission, lost=[("depth", 2.0)], refused="depth").state == "stopped"
    mission.operator.resume()
    assert state_of(report, mission).state == "starting"


@pytest.mark.parametrize(
    ("lost", "why"),
    [
        ([("colour", 1.23), ("depth", 0.9)], "waiting for colour (1.2 s), depth (0.9 s)"),
        ([("camera info", 2.0)], "waiting for camera info (2.0 s)"),
    ],
)
def test_what_is_silent_or_lacking_is_named(report, mission, lost, why):
    assert state_of(report, mission, lost=lost, frames=3).why == why


@pytest.mark.parametrize(
    ("lost", "why"),
    [
        ([("pose", 2.0)], "the camera has lost its place"),
        ([("colour", 2.0), ("pose", 2.0)], "waiting for colour (2.0 s), pose (2.0 s)"),
    ],
)
def test_a_lost_place_explains_that_poses_are_missing_and_no_more(report, mission, lost, why):
    status = state_of(
        report, mission, lost=lost, frames=3, localization="the camera has lost its place"
    )
    assert (status.state, status.why) == ("lost", why)
    assert status.localization == "the camera has lost its place"


def test_a_replay_that_has_ended_is_not_lost(report, mission):
    ended = "the replay of kitchen has ended: 200 images"
    status = state_of(report, mission, lost=[("depth", 2.0)], frames=3, ended=ended)
    assert (status.state, status.why) == ("ended", ended)
    assert state_of(report, mission, frames=3, ended=ended).state == "starting"


def test_refused_frames_are_shown_with_the_reason(report, mission):
    status = state_of(report, mission, frames=3, refused="the camera jumped 3 m", notes=("n",))
    assert (status.state, status.notes) == ("lost", ["n"])
    assert status.why == "frames are refused: the camera jumped 3 m"


def test_the_floor_of_a_restored_map_counts_before_the_first_frame(report, monkeypatch):
    restored = Mission(MissionConfig(), ZED, MATTERPORT_40, seed=0)
    monkeypatch.setattr(type(restored.voxel_map), "explored_m2", lambda _: 37.5)
    assert state_of(report, restored).explored_m2 == 37.5


def test_planning_that_runs_out_of_time_often_is_told(mission):
    planner = PlannerConfig(step_budget_s=0.04)
    report = StatusReport(NavigatorConfig(mission=MissionConfig(planner=planner)), "test")

    def notes_after(*cut_short):
        for cut in cut_short:
            report.planned(SimpleNamespace(cut_short=cut))
        return state_of(report, mission, notes=("n",)).notes

    assert notes_after(*[True] * (PLAN_WINDOW // 2 - 1)) == ["n"]
    same = SimpleNamespace(cut_short=True)
    for _ in range(PLAN_WINDOW):
        report.planned(same)  # A robot that is held does not plan.
    note = "planning exceeded its 40 ms in 25 of the last 50 frames"
    first, second = notes_after()
    assert (first, second.split(":")[0]) == ("n", note)
    assert notes_after(*[False] * PLAN_WINDOW) == ["n"]


STILL = Command(tilt_rad=-0.2)


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    return now


@pytest.fixture
def report():
    return StatusReport(NavigatorConfig(), "test")


@pytest.mark.parametrize(
    "motion",
    [
        Command(linear_m_s=0.1, tilt_rad=-0.2),
        Command(yaw_rate_rad_s=-0.1, tilt_rad=-0.2),
        Command(tilt_rad=-0.3),
    ],
)
def test_first_motion_counts_from_the_query(report, clock, motion):
    report.command_given(STILL)
    clock[0] = 110.0
    report.goal_set(since=109.0)
    report.command_given(STILL)
    assert report.first_motion_s is None
    clock[0] = 110.5
    report.command_given(motion)
    assert report.first_motion_s == pytest.approx(1.5)
    clock[0] = 120.0
    report.command_given(motion)
    assert report.first_motion_s == pytest.approx(1.5)


def test_a_robot_that_comes_later_is_waited_for_off_the_clock(report, clock):
    report.goal_set(since=50.0)
    report.command_given(STILL)
    clock[0] += 0.4
    report.command_given(Command(linear_m_s=0.1))
    assert report.first_motion_s == pytest.approx(0.4)


def test_each_goal_has_its_own(report, clock):
    report.command_given(STILL)
    report.goal_set(since=100.0)
    clock[0] += 1.0
    report.command_given(Command(linear_m_s=0.1))
    report.goal_set(since=clock[0])
    assert report.first_motion_s is None


def test_the_clock_stops_with_the_find_whatever_the_operator_does_then():
    snapshot = SimpleNamespace(elapsed_s=90.0)
    goal = GoalStatus(goal_id=1, object="hat", outcome="active")
    assert elapsed_s_of(goal, snapshot) == 90.0
    found = GoalStatus(goal_id=1, object="hat", outcome="found", took_s=31.4)
    assert elapsed_s_of(found, snapshot) == 31.4
    assert elapsed_s_of(None, None) == 0.0


def test_a_goal_has_the_rooms_of_its_finds():
    rooms = {(1.0, 2.0, 0.5): "kitchen", (3.0, 2.0, 0.5): "hall"}
    goal = GoalStatus(
        goal_id=1, object="mug", outcome="found", position_world=(1.0, 2.0, 0.5), count=3,
        counted=[
            CountedFind(number=1, position_world=(3.0, 2.0, 0.5)),
            CountedFind(number=2, position_world=(5.0, 2.0, 0.5), confirmed=True),
        ],
    )  # fmt: skip
    placed = with_room(goal, lambda position: rooms.get(position, ""))
    assert placed.room == "kitchen"
    assert [(one.number, one.room, one.confirmed) for one in placed.counted] == [
        (1, "hall", False), (2, "", True),
    ]  # fmt: skip
    missing = GoalStatus(goal_id=2, object="hat")
    assert with_room(missing, lambda _: "kitchen") == missing
