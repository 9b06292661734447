from unittest.mock import Mock

import numpy as np
import pytest

from app.links.network.requests import RequestRefusedError
from app.messages.memory import RoomNameRequest, RoomsRequest
from app.nodes.navigator.services import room_service
from app.nodes.navigator.services.room_service import RoomService
from ippon.rooms.room_inference import NO_ROOM, Rooms

AT = {"x_m": 1.0, "y_m": 1.0}


class _Events:
    def __init__(self):
        self.told = []

    def report(self, kind, text):
        self.told.append((kind, text))


class _Operations:
    """The mission's thread, for a service that infers from a copy of the map."""

    def __init__(self):
        self.mission = Mock()

    def enqueue(self, operation):
        operation(self.mission)

    def ask(self, question, timeout_s):
        assert callable(question)
        assert timeout_s > 0


@pytest.fixture(autouse=True)
def flat(monkeypatch):
    """A map with one kitchen and one room of unclear type."""
    part = np.zeros((40, 20), np.int32)
    part[:15, :10], part[16:30, :10] = 1, 2
    rooms = Rooms(
        types=("kitchen",),
        cell_m=0.2,
        origin=np.zeros(2, np.int64),
        part=part,
        room=np.array([NO_ROOM, 0, NO_ROOM]),
        probability=np.ones((3, 1)),
    )
    monkeypatch.setattr(room_service, "infer_rooms", lambda *_: rooms)


@pytest.fixture
def events():
    return _Events()


@pytest.fixture
def make(events, tmp_path):
    """Makes the service of a navigator that starts with a map of an earlier run, or without."""
    path = tmp_path / "home.map.rooms.json"

    def make(**how):
        return RoomService(_Operations(), events.report, path, **how)

    return make


def test_a_name_survives_a_restart(make, events):
    reply = make().rename(RoomNameRequest(**AT, name=" Anna's  kitchen "))
    assert [(room.kind, room.name) for room in reply.rooms] == [
        ("kitchen", "Anna's kitchen"),
        ("", ""),
    ]
    again = make(map_was_read=True)
    assert [room.name for room in again.rooms(RoomsRequest()).rooms] == ["Anna's kitchen", ""]
    assert events.told == []


def test_a_name_reaches_the_search_at_once(events):
    operations = _Operations()
    service = RoomService(operations, events.report)
    service.rename(RoomNameRequest(**AT, name="Anna's kitchen"))
    operations.mission.rooms.set_names.assert_called_once_with(service.names)


def test_names_of_a_map_that_is_gone_are_set_aside(make, events, tmp_path):
    make().rename(RoomNameRequest(**AT, name="Anna's kitchen"))
    anew = make(map_was_read=False)
    assert anew.names == ()
    assert (tmp_path / "home.map.rooms.json.aside-1").exists()
    ((kind, text),) = events.told
    assert kind == "error"
    assert "belongs to a map that is not there any more" in text
    assert anew.rooms(RoomsRequest()).note == text


def test_a_damaged_file_is_set_aside(make, events, tmp_path):
    (tmp_path / "home.map.rooms.json").write_bytes(b"[")
    assert make(map_was_read=True).names == ()
    assert "holds no names of rooms" in events.told[0][1]


def test_a_name_needs_a_room_and_must_be_short(make):
    service = make()
    with pytest.raises(RequestRefusedError, match=r"there is no room at \(90.0, 1.0\)"):
        service.rename(RoomNameRequest(x_m=90.0, y_m=1.0, name="moon"))
    with pytest.raises(RequestRefusedError, match="at most 40 printable characters; got 60"):
        service.rename(RoomNameRequest(**AT, name="x" * 60))
    assert service.names == ()


def test_names_that_cannot_be_kept_are_refused(make, tmp_path):
    service = make()
    tmp_path.joinpath("home.map.rooms.json").mkdir()
    with pytest.raises(RequestRefusedError, match="are not kept"):
        service.rename(RoomNameRequest(**AT, name="Anna's"))
    assert service.names == ()


def test_without_a_map_file_names_last_while_the_process_runs(events):
    service = RoomService(_Operations(), events.report)
    service.rename(RoomNameRequest(**AT, name="Anna's"))
    assert service.rooms(RoomsRequest()).rooms[0].name == "Anna's"


def test_points_are_in_the_room_that_holds_most_of_them(make):
    service = make()
    kitchen, unclear, outside = (1.0, 1.0), (4.0, 1.0), (90.0, 1.0)
    assert service.room_of([kitchen, unclear, outside]) == "kitchen"
    service.rename(RoomNameRequest(x_m=4.0, y_m=1.0, name="Lager"))
    assert service.room_of([kitchen, unclear, unclear]) == "Lager"
    assert service.room_of([outside]) == ""
