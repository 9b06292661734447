"""What the navigator's memory keeps, and what it says when a file cannot be used."""

import threading
from types import SimpleNamespace

import numpy as np
import pytest

from app.errors import MemoryFileError
from app.memory.memory_file import (
    journal_path,
    memory_path,
    read_memory,
    read_picture,
    write_memory,
)
from app.messages.memory import MemoryNoteRequest
from app.nodes.navigator import memory_keeper
from app.nodes.navigator.memory_keeper import MemoryKeeper
from app.nodes.navigator.node import Navigator
from app.nodes.navigator.state.planned_search import PlannedSearch
from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mapping.voxel_map import MapConfig, VoxelMap
from ippon.memory.instance_memory import MemoryChanges
from ippon.mission.finds.find_geometry import ExclusionConfig
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find
from ippon.vocabulary import MATTERPORT_40
from tests.app.memory.test_memory_file import thing
from tests.app.nodes.navigator.conftest import finds

CONFIG = MapConfig(voxel_size_m=0.2, memory_limit_mb=128.0)


@pytest.fixture
def frame():
    """A wall two metres ahead."""
    return Frame(
        stamp_ns=0,
        color=np.full((48, 64, 3), 90, np.uint8),
        depth=np.full((48, 64), 2.0, np.float32),
        camera=PinholeCamera.from_horizontal_fov(64, 48, 1.2),
        T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0)),
        T_world_base=make_transform(np.eye(3), (0.0, 0.0, 0.0)),
        tilt_rad=0.0,
    )


@pytest.fixture
def voxel_map(frame):
    voxel_map = VoxelMap(CONFIG, MATTERPORT_40)
    voxel_map.integrate(frame)
    return voxel_map


@pytest.fixture
def open_keeper(voxel_map, tmp_path):
    def open_it(events, *, robot="r", map_was_read=True):
        return MemoryKeeper(
            voxel_map,
            robot,
            lambda kind, text: events.append((kind, text)),
            memory_path(tmp_path / "home.map"),
            map_was_read=map_was_read,
        )

    return open_it


def hat_search(position=(2.0, 0.0, 1.0), found=True):
    find = Find(
        position_world=position, size_m=(0.3, 0.3, 0.3), probability=0.95, voxels=4, box_px=None
    )
    return SimpleNamespace(
        goal=SimpleNamespace(object="hat", display="my hat", thing_id=None),
        finds=(find,) if found else (),
        candidates=(),
        rejected=[],
        layer=None,
        judged=lambda _: (),
        is_rejected=lambda _: False,
        is_set_aside=lambda _: False,
        exclusion=ExclusionConfig(),
        image_check=SimpleNamespace(images=0),
    )


def until_written(keeper):
    if (writer := keeper._writer) is not None:
        writer.join(20.0)
        assert not writer.is_alive()


def test_what_was_found_is_there_after_a_restart_with_its_picture(open_keeper, frame, tmp_path):
    events = []
    keeper = open_keeper(events)
    search = hat_search()
    keeper.begin(search)
    keeper.step(frame, search, 0.0)
    (hat,) = keeper.instances
    assert keeper.picture(hat.instance_id)[:2] == b"\xff\xd8"
    keeper.close()
    path = memory_path(tmp_path / "home.map")
    (kept,) = read_memory(path, "r")
    assert (kept.label, kept.position_world) == ("hat", (2.0, 0.0, 1.0))
    again = open_keeper(events)
    assert again.instances == (kept,)
    assert again.picture(hat.instance_id) == read_picture(path, hat.instance_id)
    again.begin(hat_search(found=False))
    assert events == [("memory", "hat was last seen just now: at (2.0, 0.0), z = 1.0 m")]


def test_what_is_not_there_any_more_is_said_and_kept(open_keeper, voxel_map, frame, tmp_path):
    events = []
    keeper = open_keeper(events)
    # Nothing is where it lies: the map holds no surface there.
    search = hat_search(position=(1.0, 0.0, 1.0))
    keeper.begin(search)
    keeper.step(frame, search, 0.0)
    later = hat_search(found=False)
    keeper.begin(later)
    keeper.step(frame, later, 0.0)
    assert [kind for kind, _ in events] == ["memory", "memory"]
    assert events[1][1] == (
        "hat is not there any more, last seen just now: at (1.0, 0.0), 1.0 m high"
    )
    keeper.close()
    (kept,) = read_memory(memory_path(tmp_path / "home.map"))
    assert kept.is_gone


@pytest.mark.parametrize("case", ["cut", "robot", "map"])
def test_a_file_that_cannot_be_used_is_kept_aside_and_said(open_keeper, frame, tmp_path, case):
    path = memory_path(tmp_path / "home.map")
    write_memory(path, "r", MemoryChanges(changed={1: thing(1)}), {})
    if case == "cut":
        path.write_bytes(path.read_bytes()[:3000])
    content = path.read_bytes()
    if case == "map":
        # Of a write that was cut off; the others were opened, which undoes it.
        journal_path(path).write_bytes(b"before")
    events = []
    robot = "scout" if case == "robot" else "r"
    keeper = open_keeper(events, robot=robot, map_was_read=case != "map")
    why = {
        "cut": "home.map.memory is damaged",
        "robot": "is the memory of robot 'r'; this one is 'scout'",
        "map": "belongs to a map that is not there any more",
    }[case]
    assert keeper.problem.startswith("memory starts anew: ")
    assert why in keeper.problem
    assert keeper.problem.endswith("the file is kept as home.map.memory.aside-1")
    assert events == [("error", keeper.problem)]
    assert keeper.instances == ()
    search = hat_search()
    keeper.begin(search)
    keeper.step(frame, search, 0.0)
    keeper.close()
    aside = path.with_name("home.map.memory.aside-1")
    assert aside.read_bytes() == content
    assert journal_path(aside).exists() == (case == "map")
    assert [one.label for one in read_memory(path, robot)] == ["hat"]


def test_a_disk_that_refuses_is_said_once(open_keeper, frame, tmp_path, monkeypatch):
    monkeypatch.setattr(memory_keeper, "SAVE_EVERY_S", 0.0)
    events = []
    keeper = open_keeper(events)
    path = memory_path(tmp_path / "home.map")
    path.mkdir()
    search = hat_search()
    keeper.begin(search)
    for _ in range(3):
        keeper.step(frame, search, 0.0)
        until_written(keeper)
    assert [kind for kind, _ in events] == ["error"]
    assert "the memory is not kept in home.map.memory" in keeper.problem
    path.rmdir()
    keeper.step(frame, search, 0.0)
    until_written(keeper)
    assert keeper.problem == "", "what is kept again is no problem any more"
    keeper.close()
    assert [one.label for one in read_memory(path)] == ["hat"]


def test_without_a_file_memory_lasts_as_long_as_the_process(voxel_map, frame):
    keeper = MemoryKeeper(voxel_map, "r", lambda *_: None)
    search = hat_search()
    keeper.begin(search)
    keeper.step(frame, search, 0.0)
    (hat,) = keeper.instances
    assert keeper.picture(hat.instance_id) is not None
    assert keeper.picture(77) is None
    keeper._recollection.memory.remove(hat.instance_id)
    keeper._views_at = 0.0
    keeper.step(frame, None, 0.0)
    assert keeper.picture(hat.instance_id) is None, "what is forgotten takes no memory"
    keeper.close()


def test_what_a_person_says_is_kept_and_holds_for_searches_at_once(open_keeper, frame, tmp_path):
    keeper = open_keeper([])
    search = hat_search()
    keeper.begin(search)
    keeper.step(frame, search, 0.0)
    (hat,) = keeper.instances
    number = hat.instance_id
    keeper.note(MemoryNoteRequest(instance_id=number, name=" Opa's  hat"), [])
    later = hat_search(found=False)
    noted = keeper.note(MemoryNoteRequest(instance_id=number, deny="hat"), [later])
    assert (noted.name, noted.believed) == ("Opa's hat", "")
    assert len(later.rejected) == 1
    keeper.close()
    (kept,) = read_memory(memory_path(tmp_path / "home.map"))
    assert (kept.name, kept.denied) == ("Opa's hat", ("hat",))
    events = []
    again = open_keeper(events)
    third = hat_search(found=False)
    again.begin(third)
    assert events == [], "it is not recalled as a hat"
    assert len(third.rejected) == 1
    again.note(MemoryNoteRequest(instance_id=number, allow="hat"), [])
    again.begin(hat_search(found=False))
    assert [text for _, text in events] == [
        "Opa's hat was last seen just now: at (2.0, 0.0), z = 1.0 m"
    ]


def test_what_is_said_while_the_disk_is_slow_is_written_without_another_frame(
    open_keeper, tmp_path, monkeypatch
):
    path = memory_path(tmp_path / "home.map")
    write_memory(path, "r", MemoryChanges(changed={1: thing(1), 2: thing(2)}), {})
    keeper = open_keeper([])
    begun, may_write = threading.Event(), threading.Event()

    def slowly(*of):
        begun.set()
        assert may_write.wait(20.0)
        write_memory(*of)

    monkeypatch.setattr(memory_keeper, "write_memory", slowly)
    keeper.note(MemoryNoteRequest(instance_id=1, name="Opa's hat"), [])
    assert begun.wait(20.0)
    keeper.note(MemoryNoteRequest(instance_id=2, name="Anna's hat"), [])
    may_write.set()
    until_written(keeper)
    # Not closed: a kill must not lose what was confirmed.
    assert [one.name for one in read_memory(path)] == ["Opa's hat", "Anna's hat"]


def test_what_cannot_be_written_is_not_confirmed(open_keeper, tmp_path, monkeypatch):
    path = memory_path(tmp_path / "home.map")
    write_memory(path, "r", MemoryChanges(changed={1: thing(1)}), {})
    keeper = open_keeper([])

    def full(*_):
        raise MemoryFileError("the memory is not kept in home.map.memory: disk is full")

    monkeypatch.setattr(memory_keeper, "write_memory", full)
    first, second = (
        MemoryNoteRequest(instance_id=1, name=name) for name in ("Opa's hat", "Anna's hat")
    )
    keeper.note(first, [])
    until_written(keeper)
    monkeypatch.setattr(memory_keeper, "write_memory", write_memory)
    with pytest.raises(ValueError, match=r"not kept in home\.map\.memory: disk is full$"):
        keeper.note(second, [])
    assert [one.name for one in keeper.instances] == ["Opa's hat"]
    until_written(keeper)
    assert [one.name for one in read_memory(path)] == ["Opa's hat"], "tried again by what came"
    keeper.note(second, [])
    until_written(keeper)
    assert [one.name for one in read_memory(path)] == ["Anna's hat"]


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ({"instance_id": 9, "name": "x"}, "no thing with number 9 any more"),
        ({"instance_id": 1}, "nothing is said of the thing"),
        ({"instance_id": 1, "deny": "mug"}, "it is not taken for a mug, but for hat"),
        ({"instance_id": 1, "name": "hats"}, "is a kind of things"),
    ],
)
def test_what_makes_no_sense_is_refused_and_changes_nothing(open_keeper, frame, said, why):
    keeper = open_keeper([])
    keeper.begin(search := hat_search())
    keeper.step(frame, search, 0.0)
    before = keeper.instances
    with pytest.raises(ValueError, match=why):
        keeper.note(MemoryNoteRequest(**said), [])
    assert keeper.instances == before


def test_the_room_of_a_find_is_known_once_it_is_announced(open_keeper, frame, monkeypatch):
    rooms = ["kitchen", "hall"]
    monkeypatch.setattr(memory_keeper, "name_lookup", lambda *_: lambda _: rooms[0])
    keeper, found, elsewhere = open_keeper([]), (2.0, 0.0, 1.0), (2.0, 0.0, 4.0)
    keeper.step(frame, hat_search(found=False), 0.0)
    assert keeper.room_of(found) == ""
    keeper.step(frame, hat_search(), 0.0)
    assert keeper.room_of(found) == "kitchen"
    assert keeper.room_of(elsewhere) == ""
    # On another floor the room that was below says nothing of the find there.
    rooms.pop(0)
    keeper.step(frame, hat_search(found=False), 3.0)
    keeper.step(frame, hat_search(position=elsewhere), 3.0)
    assert keeper.room_of(elsewhere) == "hall"
    assert keeper.room_of(found) == "kitchen"
    keeper.close()


def test_what_an_earlier_run_has_judged_is_excluded_before_memory_is_asked():
    one, two = finds(2)
    resolved = resolve_object("mug", MATTERPORT_40)
    goal = Goal.of(resolved, 3)
    planned = PlannedSearch(
        goal=goal,
        resolved=resolved,
        guidance=EmbeddedPrior().levels(resolved, "", MATTERPORT_40),
        elapsed_ms=0.0,
        counted=(one,),
        rejected=(two,),
    )
    calls = []
    search = SimpleNamespace(goal=goal)
    goals = SimpleNamespace(
        set_goal=lambda *_: calls.append("set_goal"),
        count_again=lambda *known: calls.append(known),
        running=(search,),
    )
    navigator = SimpleNamespace(
        _goals=SimpleNamespace(next=lambda *_, **__: (planned,)),
        _services=SimpleNamespace(
            guidance=SimpleNamespace(fitted=lambda search: search),
            goals=SimpleNamespace(availability=SimpleNamespace(holds=False)),
        ),
        _mission=SimpleNamespace(goals=goals),
        _memory=SimpleNamespace(begin=calls.append),
        _report=SimpleNamespace(goal_set=lambda _: None),
    )
    Navigator._start_next_goal(navigator)
    assert calls == ["set_goal", (3, (one,), (two,)), search]
