"""Rooms that were said weigh the map from when they are recognised or named."""

import numpy as np
import pytest

from ippon.mission.places import room_regions
from ippon.mission.snapshot import Find
from ippon.rooms.named_rooms import RoomName
from ippon.rooms.room_inference import NO_ROOM, Rooms

SECOND_NS = 1_000_000_000
TYPES = ("bathroom", "bedroom", "kitchen")
LEFT, RIGHT = (1.0, 1.0), (3.0, 1.0)


def _rooms(left=NO_ROOM):
    """Two rooms of 2 m, the left one of a type."""
    probability = np.full((3, 3), 1.0 / 3.0)
    if left != NO_ROOM:
        probability[1] = np.eye(3)[left]
    return Rooms(
        types=TYPES,
        cell_m=0.2,
        origin=np.zeros(2, np.int64),
        part=np.repeat(np.repeat(np.array([[1], [2]], np.int32), 10, axis=0), 10, axis=1),
        room=np.array([NO_ROOM, left, NO_ROOM]),
        probability=probability,
    )


@pytest.fixture
def home(searcher, room, monkeypatch):
    """A mission whose map has the rooms that the test sets, and the weights that it gives."""

    class Home:
        rooms = _rooms()
        weights = None
        times = 0

    monkeypatch.setattr(room_regions, "infer_rooms", lambda *_: Home.rooms)
    robot = searcher(room(6.0, 4.5), 1.0, 2.0)
    Home.mission = robot.mission
    Home.ask = robot.ask

    def set_rooms(grid):
        Home.weights = grid
        Home.times += 1

    monkeypatch.setattr(robot.mission.operator, "set_rooms", set_rooms)

    def step(at_s):
        regions = Home.mission.rooms
        regions.step(Home.mission.goals.running, int(at_s * SECOND_NS), 0.0)
        at = np.array([LEFT, RIGHT])
        return None if Home.weights is None else Home.weights.at(at).tolist()

    Home.step = staticmethod(step)
    return Home


def test_a_search_without_a_room_weighs_nothing(home):
    home.ask("mug", context="on the table")
    assert home.step(0.0) is None
    assert home.mission.rooms.text == ""


def test_a_room_counts_when_it_is_recognised(home):
    home.ask("mug", context="in the kitchen")
    assert home.step(0.0) is None, "nothing is known yet"
    assert "no room of that name yet: kitchen" in home.mission.rooms.text
    home.rooms = _rooms(left=2)
    assert home.step(1.0) is None, "rooms are inferred every five seconds"
    assert home.step(6.0) == [3.0, 1.0]
    assert home.mission.rooms.text == "looks first in: kitchen (inferred from what is there)"


def test_rooms_that_are_inferred_as_before_are_not_weighed_again(home):
    home.ask("mug", context="in the kitchen")
    home.rooms = _rooms(left=2)
    for at_s in (0.0, 6.0, 12.0):
        assert home.step(at_s) == [3.0, 1.0]
    assert home.times == 1
    home.rooms = _rooms(left=1)
    assert home.step(18.0) == [0.25, 1.0]
    assert home.times == 2


def test_a_name_counts_at_once(home):
    home.ask("mug", context="in Anna's room")
    home.step(0.0)
    home.mission.rooms.set_names([RoomName(x_m=3.0, y_m=1.0, name="Anna's room")])
    assert home.step(0.1) == [0.25, 3.0]
    home.mission.rooms.set_names([])
    assert home.step(0.2) == [1.0, 1.0], "the name was removed"


def test_the_weights_end_with_the_search(home):
    home.mission.rooms.set_names([RoomName(x_m=3.0, y_m=1.0, name="Anna")])
    home.ask("mug", context="in Anna's room")
    home.step(0.0)
    assert home.weights is not None
    home.ask("hat")
    assert home.step(0.1) is None


def test_a_find_in_another_room_is_known_to_be_elsewhere(home):
    home.mission.rooms.set_names([RoomName(x_m=3.0, y_m=1.0, name="Anna")])
    home.ask("mug", context="in Anna's room")
    home.step(0.0)
    search, regions = home.mission.search, home.mission.rooms
    there = [
        Find(
            position_world=(*xy, 0.8),
            size_m=(0.1, 0.1, 0.1),
            probability=0.99,
            voxels=2,
            box_px=None,
        )
        for xy in (LEFT, RIGHT, (9.0, 9.0))
    ]
    assert [regions.is_elsewhere(search, find) for find in there] == [True, False, False]
