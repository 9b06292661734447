"""Operator requests over the network: paint, go there, what if; each refusal says why."""

import dataclasses
import threading
import time
from types import SimpleNamespace
from typing import Any

import pytest

from app.links.network.latched_topic import LatchedTopic
from app.links.network.requests import RequestRefusedError, ask, last_message
from app.links.network.sender import Sender
from app.messages import keys
from app.messages.control import (
    Accepted,
    InspectReply,
    InspectRequest,
    PreviewReply,
    PreviewRequest,
    decode,
)
from app.messages.driving import DriveRequest, GotoRequest, PaintedRegions, PaintRequest
from app.nodes.navigator.services.drive_service import DriveService, drive_refusal
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.services.preview_service import PreviewService
from app.nodes.navigator.services.request_services import declare_endpoints
from app.nodes.navigator.state.goal_queue import GoalQueue
from ippon.control.drive_mode import DriveMode
from ippon.mapping.voxel_map import MapConfig, VoxelMap
from ippon.mission.snapshot import MissionState
from ippon.robot import ZED

ROBOT = "ippon"
PATIENCE_S = 20.0


class Missionary:
    """Stands in for the mission: notes what reaches it, knows one way."""

    def __init__(self) -> None:
        self.modes: list[DriveMode] = []
        self.limits: list[float] = []
        self.regions: list[object] = []
        self.voxel_map = VoxelMap(MapConfig(), ["wall"])
        self.floor_z_m = 0.0
        self.operator = self.goals = self
        self.held: MissionState | None = None

    def drive(self, mode) -> None:
        self.modes.append(mode)

    def limit_speed(self, share) -> None:
        self.limits.append(share)

    def go_to(self, xy):
        return 2.5 if xy[0] < 10.0 else None

    def cancel_go_to(self) -> None:
        self.modes.append(DriveMode.AUTO)

    def set_regions(self, regions) -> bool:
        self.regions.append(regions)
        return True


class Mux:
    """Stands in for what commands the robot: keeps mode and limit."""

    def __init__(self) -> None:
        self.now = SimpleNamespace(mode="auto", speed_limit=1.0)

    def set_mode(self, mode, limit) -> None:
        self.now = SimpleNamespace(mode=mode.value, speed_limit=limit)

    def status(self):
        return self.now


def room_of(points):
    if points[0][0] < 0.0:
        raise RequestRefusedError("the navigator is busy")
    return "Anna's room"


def _await(condition):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture
def service(sessions):
    router, client = sessions
    mission, sender = Missionary(), Sender()

    class ThreadPerOperation(OperationQueue):
        def enqueue(self, operation) -> None:
            threading.Thread(target=operation, args=(mission,)).start()

    operations = ThreadPerOperation(wake=lambda: None)

    mux: Any = Mux()
    goals = GoalQueue(3)
    painted = LatchedTopic(router, f"{ROBOT}/{keys.PAINTED}", sender)
    drive = DriveService(mux, operations, painted, ZED)
    drive.room_of = room_of
    preview = PreviewService(goals, operations)
    endpoints = [declare_endpoints(router, ROBOT, service) for service in (drive, preview)]

    def request(key, message, kind=Accepted):
        return ask(client, f"{ROBOT}/{key}", message, kind, PATIENCE_S)

    yield SimpleNamespace(
        mission=mission, mux=mux, goals=goals, request=request, client=client, parts=endpoints
    )
    sender.close()


def test_the_mode_reaches_mux_and_mission(service):
    reply = service.request(keys.DRIVE, DriveRequest(mode="manual", speed_limit=0.5))
    assert reply.detail == "manual, at most 50% of the speed"
    _await(lambda: service.mission.modes == [DriveMode.MANUAL])
    _await(lambda: service.mission.limits == [0.5])
    assert service.mux.now == SimpleNamespace(mode="manual", speed_limit=0.5)


def test_a_limit_keeps_the_mode_and_a_mode_the_limit(service):
    service.request(keys.DRIVE, DriveRequest(mode="manual"))
    reply = service.request(keys.DRIVE, DriveRequest(speed_limit=0.2))
    assert reply.detail == "manual, at most 20% of the speed"
    service.request(keys.DRIVE, DriveRequest(mode="assisted"))
    assert service.mux.now == SimpleNamespace(mode="assisted", speed_limit=0.2)
    _await(lambda: sorted(service.mission.limits) == [0.2, 0.2, 1.0])
    _await(lambda: len(service.mission.modes) == 2)
    assert set(service.mission.modes) == {DriveMode.MANUAL, DriveMode.ASSISTED}


def test_another_limit_alone_leaves_the_point_that_the_robot_drives_to(service):
    # The mission forgets that point with each mode.
    for mode, limit in (("auto", 0.5), ("auto", 0.8), ("auto", 0.8), ("manual", 0.8)):
        service.request(keys.DRIVE, DriveRequest(mode=mode, speed_limit=limit))
        assert service.mux.now == SimpleNamespace(mode=mode, speed_limit=limit)
    # Each operation has a thread of its own here.
    _await(lambda: len(service.mission.modes) == 2)
    assert set(service.mission.modes) == {DriveMode.AUTO, DriveMode.MANUAL}


def test_a_robot_that_navigates_by_itself_returns_from_the_hand_at_its_own_speed():
    mux: Any = Mux()
    operations: Any = SimpleNamespace(enqueue=lambda _: None)
    profile = dataclasses.replace(ZED, takes_goals=True, takes_velocities=True)
    drive = DriveService(mux, operations, operations, profile)
    drive.drive(DriveRequest(mode="manual", speed_limit=0.5))
    assert drive.drive(DriveRequest(mode="auto")).detail == "auto, at most 100% of the speed"
    with pytest.raises(RequestRefusedError, match="no limit can be set"):
        drive.drive(DriveRequest(mode="auto", speed_limit=0.5))


@pytest.mark.parametrize(
    ("takes", "mode", "limit", "text"),
    [
        ((True, False), DriveMode.MANUAL, 1.0, "takes no velocities: send it to a point"),
        ((True, False), DriveMode.ASSISTED, 1.0, "takes no velocities: send it to a point"),
        ((True, False), DriveMode.AUTO, 1.0, ""),
        ((True, False), DriveMode.AUTO, 0.5, "no limit can be set"),
        ((True, True), DriveMode.MANUAL, 0.5, ""),
        ((True, True), DriveMode.ASSISTED, 1.0, "no velocities to assist with"),
        ((False, True), DriveMode.ASSISTED, 0.5, ""),
    ],
)
def test_driving_a_robot_that_navigates_by_itself_is_refused_with_the_reason(
    takes, mode, limit, text
):
    profile = dataclasses.replace(ZED, takes_goals=takes[0], takes_velocities=takes[1])
    problem = drive_refusal(profile, mode, limit)
    assert text in problem
    assert bool(text) == bool(problem)


def test_goes_where_there_is_a_way_and_says_so_where_there_is_none(service):
    assert (
        service.request(keys.GOTO, GotoRequest(x_m=1.0, y_m=2.0)).detail == "driving there, 2.5 m"
    )
    with pytest.raises(RequestRefusedError, match=r"no path is known to \(50.0, 2.0\); choose a"):
        service.request(keys.GOTO, GotoRequest(x_m=50.0, y_m=2.0))
    with pytest.raises(RequestRefusedError, match="not a GotoRequest"):
        service.request(keys.GOTO, GotoRequest(x_m=1e9))


@pytest.mark.parametrize("held", [MissionState.STOPPED, MissionState.PAUSED])
def test_a_robot_that_is_held_is_said_to_go_there_after_resume(service, held):
    service.mission.held = held
    reply = service.request(keys.GOTO, GotoRequest(x_m=1.0, y_m=2.0))
    assert reply.detail == "the robot drives there after Resume, 2.5 m"


def test_what_is_painted_counts_is_kept_for_late_joiners_and_can_be_undone(service):
    dab = PaintRequest(action="look_here", strokes=[(1.0, 2.0)], radius_m=0.5)
    assert service.request(keys.PAINT, dab).detail == "searching there first"
    kept = last_message(service.client, f"{ROBOT}/{keys.PAINTED}", PATIENCE_S)
    assert kept is not None
    regions = decode(kept, PaintedRegions).regions
    assert [(r.kind, r.strokes, r.radius_m) for r in regions] == [("look_here", [(1.0, 2.0)], 0.5)]
    assert regions[0].room == "Anna's room"
    unnamed = PaintRequest(action="not_here", strokes=[(-1.0, 2.0)], radius_m=0.5)
    assert service.request(keys.PAINT, unnamed).detail == "not searching there"
    service.request(keys.PAINT, PaintRequest(action="undo"))
    assert service.request(keys.PAINT, PaintRequest(action="undo")).detail == "undone; 0 left"
    with pytest.raises(RequestRefusedError, match="there is no painted region to undo"):
        service.request(keys.PAINT, PaintRequest(action="undo"))
    with pytest.raises(RequestRefusedError, match="a stroke needs at least one point"):
        service.request(keys.PAINT, PaintRequest(action="not_here"))


def test_a_stroke_far_from_the_others_is_refused_and_not_kept(service):
    dab = PaintRequest(action="look_here", strokes=[(1.0, 1.0)], radius_m=0.5)
    service.request(keys.PAINT, dab)
    _await(lambda: len(service.mission.regions) == 1)
    for far in ((3500.0, 1200.0), (1.0, 310.0)):
        with pytest.raises(RequestRefusedError, match=r"would be \d+ m long, at most 300 m are"):
            service.request(keys.PAINT, PaintRequest(action="not_here", strokes=[far]))
    with pytest.raises(RequestRefusedError, match="not a PaintRequest"):
        service.request(keys.PAINT, PaintRequest(action="not_here", strokes=[(0.0, 1e9)]))
    alone = PaintRequest(action="not_here", strokes=[(0.0, 0.0), (200.0, 200.0), (0.0, 290.0)])
    service.request(keys.PAINT, alone)
    _await(lambda: len(service.mission.regions) == 2)
    assert [stroke.points for stroke in service.mission.regions[1]] == [
        ((1.0, 1.0),), tuple(alone.strokes)
    ]  # fmt: skip


def test_questions_without_an_answer_say_why(service):
    with pytest.raises(RequestRefusedError, match="there is no goal whose levels could change"):
        service.request(keys.PREVIEW, PreviewRequest(context="on the sofa"), PreviewReply)
    with pytest.raises(RequestRefusedError, match="the map has no surface there"):
        service.request(keys.INSPECT, InspectRequest(point_world=(0.0, 0.0, 0.0)), InspectReply)


def test_a_camera_that_a_person_carries_cannot_be_driven():
    profile = dataclasses.replace(ZED, name="held", takes_goals=False, takes_velocities=False)
    assert drive_refusal(profile, DriveMode.AUTO, 1.0) == ""
    for mode, limit in ((DriveMode.MANUAL, 1.0), (DriveMode.AUTO, 0.5)):
        text = drive_refusal(profile, mode, limit)
        assert text == "a person carries held: there is nothing to drive"
