"""What a navigator leaves behind, and what the next one makes of it."""

import dataclasses
import errno
import queue
import threading
import time

import msgspec
import numpy as np
import pytest

from app.links.network.requests import ask
from app.links.network.subscription import is_alive, subscribe
from app.messages import keys
from app.messages.control import (
    ControlReply,
    ControlRequest,
    GuidanceRequest,
    SearchAccepted,
    SearchRequest,
    decode,
)
from app.messages.status import CountedFind, LevelTable
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.node import Navigator
from app.nodes.navigator.state import persistence as persistence_module
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.state.persistence import (
    RECENT_S,
    RunState,
    SavedGoal,
    SavedState,
    StatePersistence,
    read_saved_state,
)
from ippon.atomic_file import replace_file
from ippon.camera import PinholeCamera
from ippon.errors import MapFileError
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.guidance.levels import BY_OPERATOR, Level
from ippon.mapping.voxel_map import MapConfig, VoxelMap
from ippon.mission.snapshot import Find, MissionState
from ippon.vocabulary import MATTERPORT_40
from tests.app.nodes.navigator.conftest import run_next, search

RUN = RunState(held=False, mode="auto", speed_limit=0.5)
CONFIG = MapConfig(voxel_size_m=0.2, memory_limit_mb=128.0)


@pytest.fixture
def voxel_map():
    """A wall two metres ahead."""
    voxel_map = VoxelMap(CONFIG, (*MATTERPORT_40, "bookcase"))
    voxel_map.set_ooi("keys")
    voxel_map.integrate(
        Frame(
            stamp_ns=0,
            color=np.zeros((24, 32, 3), np.uint8),
            depth=np.full((24, 32), 2.0, np.float32),
            camera=PinholeCamera.from_horizontal_fov(32, 24, 1.2),
            T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0)),
            T_world_base=make_transform(np.eye(3), (0.0, 0.0, 0.0)),
            tilt_rad=0.0,
            heatmap=None,
        )
    )
    return voxel_map


def keep(path, voxel_map, goals, run):
    """Keep a state and wait until goals and run are written."""
    keep_with(StatePersistence(path, lambda *_: None), voxel_map, goals, run)


def keep_with(persistence, voxel_map, goals, run):
    persistence.keep_state(goals, run)
    persistence.keep_map(voxel_map)
    persistence._small.wait()


def test_nothing_is_read_where_nothing_was_kept(tmp_path):
    assert read_saved_state(tmp_path / "home.map", CONFIG) is None


def test_map_and_goals_are_there_for_the_next_start(open_office, voxel_map, tmp_path, sessions):
    office = open_office()
    search(office, "hat", "on the sofa")
    search(office, "mug", "", start=False)
    path = tmp_path / "home.map"
    persistence = StatePersistence(path, lambda *_: None, every_s=0.0)
    persistence.keep_state(office.goals, RUN)
    persistence.keep_map(voxel_map)
    persistence.close(voxel_map, office.goals)
    kept = read_saved_state(path, CONFIG)
    assert [(r.object, r.context) for r in kept.requests] == [("hat", "on the sofa"), ("mug", "")]
    assert kept.voxel_map.labels == (*MATTERPORT_40, "bookcase")
    assert kept.voxel_map.ooi is None
    wall = np.array([[2.1, 0.0, 1.0]])
    assert kept.voxel_map.state_at(wall) == voxel_map.state_at(wall)
    config = NavigatorConfig(robot="r", labels=kept.voxel_map.labels)
    navigator = Navigator(config, sessions[0], saved=kept)
    try:
        stop = threading.Event()
        thread = threading.Thread(target=navigator.run, args=(stop,))
        thread.start()
        while navigator._goals.active() is None:
            stop.wait(0.02)
        stop.set()
        thread.join()
        assert navigator._mission.goal.object == "hat"
        assert navigator._mission.state is MissionState.STOPPED
        assert [s.goal.object for s in navigator._goals.unfinished()] == ["hat", "mug"]
    finally:
        navigator.close()


def test_the_goals_of_a_tour_that_were_not_found_are_one_tour_again(
    open_office, tmp_path, sessions
):
    office = open_office()
    for name, joins in (("hat", None), ("mug", 1), ("keys", 1), ("plant", None)):
        planned = office.guidance.plan(SearchRequest(object=name), 0.0)
        office.goals.add(planned, joins)
    office.goals.next()
    office.goals.conclude("found", 1)
    path = tmp_path / "home.map"
    keep(path, office.mission.voxel_map, office.goals, RUN)
    kept = read_saved_state(path, CONFIG)
    assert [(r.object, r.joins) for r in kept.requests] == [
        ("mug", None), ("keys", 1), ("plant", None)
    ]  # fmt: skip
    navigator = Navigator(NavigatorConfig(robot="r"), sessions[0], saved=kept)
    try:
        navigator._start_next_goal()
        assert [g.object for g in navigator._goals.tour()] == ["mug", "keys"]
        assert navigator._mission.goals.asked == ("mug", "keys")
        assert navigator._mission.state is MissionState.STOPPED
    finally:
        navigator.close()


def test_all_goals_of_a_full_queue_are_there_for_the_next_start(open_office, tmp_path, sessions):
    office = open_office()
    for name, joins in (("hat", None), ("mug", 1), ("keys", None), ("plant", None)):
        office.goals.add(office.guidance.plan(SearchRequest(object=name), 0.0), joins)
    office.goals.next()
    path = tmp_path / "home.map"
    keep(path, office.mission.voxel_map, office.goals, RUN)
    kept = read_saved_state(path, CONFIG)
    navigator = Navigator(NavigatorConfig(robot="r", max_queue=2), sessions[0], saved=kept)
    try:
        assert [s.goal.object for s in navigator._goals.unfinished()] == [
            "hat", "mug", "keys", "plant"
        ]  # fmt: skip
    finally:
        navigator.close()


def test_a_goal_that_cannot_be_taken_up_keeps_none_of_the_others(tmp_path, sessions):
    path = tmp_path / "home.map"
    requests = [{"object": "?"}, {"object": "mug", "joins": 1}, {"object": "keys", "joins": 1}]
    requests.append({"object": "x" * 160})
    path.with_name("home.map.goals.json").write_bytes(msgspec.json.encode(requests))
    kept = read_saved_state(path, CONFIG)
    navigator = Navigator(NavigatorConfig(robot="r"), sessions[0], saved=kept)
    try:
        navigator._start_next_goal()
        assert [g.object for g in navigator._goals.tour()] == ["mug", "keys"]
        assert len(navigator._goals.unfinished()) == 3
    finally:
        navigator.close()


def test_levels_that_the_operator_set_are_there_for_the_next_start(
    open_office, voxel_map, tmp_path, sessions
):
    router, client = sessions
    office = open_office()
    search(office, "hat", "on the sofa")
    for label, level in (("sofa", "far"), ("toilet", "near"), ("sofa", "average")):
        office.guidance.set_level(GuidanceRequest(label=label, level=level))
        run_next(office)
    search(office, "mug", "", start=False)
    path = tmp_path / "home.map"
    keep(path, voxel_map, office.goals, RUN)
    kept = read_saved_state(path, CONFIG)
    assert [r.levels for r in kept.requests] == [{"toilet": "near", "sofa": "average"}, {}]
    navigator, stop = Navigator(NavigatorConfig(robot="s"), router, saved=kept), threading.Event()
    tables = queue.SimpleQueue()
    subscribe(client, f"s/{keys.LEVELS}", lambda p: tables.put(decode(p, LevelTable)))
    assert is_alive(client, f"s/{keys.NAVIGATOR_ALIVE}", 60.0), (
        "and so the router knows who listens"
    )
    thread = threading.Thread(target=navigator.run, args=(stop,))
    thread.start()
    try:
        table = tables.get(timeout=120.0)
        rows = {row.label: (row.level, row.reason) for row in table.rows}
        assert rows["toilet"] == ("near", BY_OPERATOR)
        assert rows["sofa"] == ("average", BY_OPERATOR)
        assert [name for name, (_, why) in rows.items() if why == BY_OPERATOR] == ["sofa", "toilet"]
        levels = dict(zip(MATTERPORT_40, navigator._mission.search.guidance.levels(), strict=True))
        assert levels["toilet"] == Level.NEAR
        # They go on to be kept.
        assert [g.edits for g in navigator._goals.unfinished()] == [
            g.edits for g in office.goals.unfinished()
        ]
    finally:
        stop.set()
        thread.join()
        navigator.close()


def test_what_was_found_of_several_counts_at_the_next_start(open_office, tmp_path, sessions):
    office = open_office()
    planned = office.guidance.plan(SearchRequest(object="chair", count=3), 0.0)
    office.goals.add(planned)
    office.goals.next()
    find = Find(
        position_world=(1.0, 2.0, 0.4), size_m=(0.5, 0.5, 0.9), probability=0.9, voxels=40,
        box_px=None,
    )  # fmt: skip
    wrong = dataclasses.replace(find, position_world=(4.0, 2.0, 0.4))
    finds = [dataclasses.replace(find, number=2, confirmed=True)]
    rejected = [dataclasses.replace(wrong, number=1)]
    office.goals.note_finds(1, finds, rejected)
    path = tmp_path / "home.map"
    keep(path, office.mission.voxel_map, office.goals, RUN)
    kept = read_saved_state(path, CONFIG)
    navigator = Navigator(NavigatorConfig(robot="r"), sessions[0], saved=kept)
    try:
        navigator._start_next_goal()
        search, status = navigator._mission.search, navigator._goals.statuses()[0]
        assert (search.counted, search.refused) == (finds, rejected)
        assert search.is_rejected(wrong), "it is not found again"
        counted = CountedFind(number=2, position_world=find.position_world, confirmed=True)
        assert (status.counted, status.rejected) == ([counted], 1)
        assert search.numbered(find).number == 3, "no number is used twice"
    finally:
        navigator.close()


def test_goals_that_were_kept_without_levels_are_taken_up(tmp_path):
    path = tmp_path / "home.map"
    goals = [SearchRequest(object="hat", context="on the sofa", requester="x")]
    path.with_name("home.map.goals.json").write_bytes(msgspec.json.encode(goals))
    (goal,) = read_saved_state(path, CONFIG).requests
    assert (goal.object, goal.context, goal.levels) == ("hat", "on the sofa", {})


def test_a_goal_that_is_over_is_not_taken_up(open_office, voxel_map, tmp_path):
    office = open_office()
    search(office)
    office.goals.conclude("found")
    persistence = StatePersistence(tmp_path / "home.map", lambda *_: None)
    keep_with(persistence, voxel_map, office.goals, RUN)
    kept = read_saved_state(tmp_path / "home.map", CONFIG)
    assert kept.requests == ()
    assert kept.voxel_map is None, "it is too early for the map"


def test_what_a_killed_navigator_wrote_half_is_removed(tmp_path):
    path = tmp_path / "home.map"
    half = [tmp_path / f"home.map{part}.123.partial" for part in ("", ".goals.json", ".run.json")]
    for one in half:
        one.write_bytes(b"IPPONMAP")
    StatePersistence(path, lambda *_: None)
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_is_full_is_told_once(open_office, voxel_map, tmp_path):
    told = []
    goals = open_office().goals
    persistence = StatePersistence(
        tmp_path / "missing" / "home.map", lambda *event: told.append(event), every_s=0.0
    )
    for _ in range(4):
        keep_with(persistence, voxel_map, goals, RUN)
        if persistence._writer is not None:
            persistence._writer.join()
    assert [kind for kind, _ in told] == ["error"]
    assert "kept in home.map" in told[0][1]
    assert "No such file" in told[0][1]


def test_a_stop_that_a_full_disk_cannot_keep_is_not_forgotten(tmp_path, monkeypatch):
    def fail(path, content):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(persistence_module, "AGAIN_S", 0.0)
    path, goals = tmp_path / "home.map", GoalQueue(3)
    persistence = StatePersistence(path, lambda *_: None)
    held = msgspec.structs.replace(RUN, held=True)
    for run, write, read in (
        (RUN, replace_file, RUN),
        (held, fail, None),
        (held, replace_file, held),
    ):
        monkeypatch.setattr(persistence_module, "replace_file", write)
        persistence.keep_state(goals, run)
        persistence._small.wait()
        assert read_saved_state(path, CONFIG).interrupted == read


def test_a_full_disk_is_not_tried_in_every_round(tmp_path, monkeypatch):
    tried = []

    def fail(path, content):
        tried.append(path.name)
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(persistence_module, "AGAIN_S", 3600.0)
    monkeypatch.setattr(persistence_module, "replace_file", fail)
    persistence = StatePersistence(tmp_path / "home.map", lambda *_: None)
    for _ in range(5):
        persistence.keep_state(GoalQueue(3), RUN)
        persistence._small.wait()
    assert len([name for name in tried if "run" in name]) == 1


def test_a_disk_that_takes_its_time_holds_up_nobody(open_office, voxel_map, tmp_path, monkeypatch):
    disk = threading.Semaphore(0)

    def write_late(path, content):
        assert disk.acquire(timeout=30.0)
        replace_file(path, content)

    monkeypatch.setattr(persistence_module, "replace_file", write_late)
    path, office = tmp_path / "home.map", open_office()
    persistence = StatePersistence(path, lambda *_: None)
    search(office, "hat")
    persistence.keep_state(office.goals, RUN)
    persistence.keep_map(voxel_map)
    search(office, "mug", "", start=False)
    held = RunState(held=True, mode="auto", speed_limit=1.0)
    persistence.keep_state(office.goals, held)
    assert not path.with_name("home.map.goals.json").exists()
    disk.release(4)
    persistence._small.wait()
    kept = read_saved_state(path, CONFIG)
    assert [r.object for r in kept.requests] == ["hat", "mug"]
    assert kept.interrupted == held


def test_what_is_no_map_is_refused_with_a_reason(voxel_map, tmp_path):
    path = tmp_path / "home.map"
    path.write_bytes(b"hello")
    with pytest.raises(MapFileError, match="not a map file"):
        read_saved_state(path, CONFIG)
    voxel_map.save(path)
    with pytest.raises(MapFileError, match=r"voxel_size_m 0\.2; asked for 0\.1"):
        read_saved_state(path, MapConfig())
    (tmp_path / "home.map.goals.json").write_text('[{"object": 3}]')
    with pytest.raises(MapFileError, match="holds no goals"):
        read_saved_state(path, CONFIG)
    (tmp_path / "home.map.goals.json").write_text('[{"object": "hat", "levels": {"bed": "high"}}]')
    with pytest.raises(MapFileError, match="holds no goals: Invalid enum value 'high'"):
        read_saved_state(path, CONFIG)


def test_a_killed_run_is_told_from_one_that_ended(open_office, voxel_map, tmp_path):
    path, office = tmp_path / "home.map", open_office()
    search(office, "hat")
    persistence = StatePersistence(path, lambda *_: None)
    keep_with(persistence, voxel_map, office.goals, RUN)
    assert read_saved_state(path, CONFIG).interrupted == RUN
    held = RunState(held=True, mode="auto", speed_limit=1.0)
    keep_with(persistence, voxel_map, office.goals, held)
    assert not read_saved_state(path, CONFIG).interrupted.may_go_on
    run_file = tmp_path / "home.map.run.json"
    run_file.write_text("{")
    assert read_saved_state(path, CONFIG).interrupted is None
    persistence.close(voxel_map, office.goals)
    assert not run_file.exists()


@pytest.mark.parametrize(
    ("later", "is_recent"),
    [
        (("boot", 1000.0 + RECENT_S - 1.0), True),
        (("boot", 1000.0 + RECENT_S + 1.0), False),
        (("boot", 999.0), False),
        (("boot after a power cut", 1001.0), False),
    ],
)
def test_only_a_run_that_was_killed_a_moment_ago_goes_on(tmp_path, monkeypatch, later, is_recent):
    monkeypatch.setattr(persistence_module, "boot_time", lambda: ("boot", 1000.0))
    path = tmp_path / "home.map"
    persistence = StatePersistence(path, lambda *_: None)
    persistence.keep_state(GoalQueue(3), RUN)
    persistence._small.wait()
    monkeypatch.setattr(persistence_module, "boot_time", lambda: later)
    assert read_saved_state(path, CONFIG).interrupted == (RUN if is_recent else None)


def test_the_run_of_an_earlier_version_does_not_go_on(tmp_path):
    path = tmp_path / "home.map"
    path.with_name("home.map.goals.json").write_bytes(b"[]")
    path.with_name("home.map.run.json").write_bytes(msgspec.json.encode(RUN))
    assert read_saved_state(path, CONFIG).interrupted is None


def test_a_stop_and_a_goal_are_kept_while_no_frame_comes(tmp_path, sessions):
    path = tmp_path / "home.map"
    navigator = Navigator(NavigatorConfig(robot="r", keep_map=str(path)), sessions[0])
    stop = threading.Event()
    thread = threading.Thread(target=navigator.run, args=(stop,))
    thread.start()
    try:
        ask(sessions[1], "r/search", SearchRequest(object="hat"), SearchAccepted, 10.0)
        ask(sessions[1], "r/control", ControlRequest(action="stop"), ControlReply, 10.0)
        deadline = time.monotonic() + 20.0
        kept = None
        while not (kept and kept.requests and kept.interrupted and kept.interrupted.held):
            assert time.monotonic() < deadline, kept
            stop.wait(0.02)
            kept = read_saved_state(path, CONFIG)
        assert [request.object for request in kept.requests] == ["hat"]
    finally:
        stop.set()
        thread.join()
        navigator.close()


@pytest.mark.parametrize(
    ("held", "state"), [(True, MissionState.STOPPED), (False, MissionState.STARTING)]
)
def test_a_stop_holds_over_a_crash_also_without_a_goal(sessions, held, state):
    ran = RunState(held=held, mode="auto", speed_limit=1.0)
    saved = SavedState(voxel_map=None, requests=(), interrupted=ran)
    navigator = Navigator(NavigatorConfig(robot="r"), sessions[0], saved=saved)
    try:
        assert navigator._mission.state is state
    finally:
        navigator.close()


@pytest.mark.parametrize(
    ("resume", "requests", "held"),
    [
        (True, (SavedGoal(object="hat"),), False),
        (True, (SavedGoal(object="hat"),), True),
        (False, (SavedGoal(object="hat"),), False),
        (False, (), True),
    ],
)
def test_a_killed_run_hands_on_its_speed_limit_to_command_and_mission(
    sessions, resume, requests, held
):
    """Also where the robot waits for Resume."""
    ran = RunState(held=held, mode="auto", speed_limit=0.3)
    saved = SavedState(voxel_map=None, requests=requests, interrupted=ran)
    navigator = Navigator(NavigatorConfig(robot="r", resume=resume), sessions[0], saved=saved)
    try:
        stands = not resume or held
        assert (navigator._mission.state is MissionState.STOPPED) == stands
        assert navigator._services.mux.status().speed_limit == 0.3
        assert navigator._mission.operator.speed_limit == 0.3
    finally:
        navigator.close()


def test_who_drove_by_hand_is_not_succeeded_by_the_plan():
    assert RUN.may_go_on
    assert not RunState(held=False, mode="manual", speed_limit=1.0).may_go_on
