import dataclasses

import numpy as np
import pytest

from ippon.rooms.named_rooms import RoomName, name_lookup, renamed, room_places
from ippon.rooms.room_inference import NO_ROOM, Rooms

KITCHEN = (1.0, 1.0)
OTHER = (4.0, 1.0)


def _rooms(shift=0, door=15):
    """Two rooms of 0.2 m cells, divided at a door, and a niche of one cell."""
    part = np.zeros((40, 20), np.int32)
    part[:door, :10] = 1
    part[door + 1 : 30, :10] = 2
    part[35, 15] = 3
    return Rooms(
        types=("kitchen", "living_room"),
        cell_m=0.2,
        origin=np.array([shift, 0]),
        part=part,
        room=np.array([NO_ROOM, 0, NO_ROOM, NO_ROOM]),
        probability=np.array([[0.5, 0.5], [0.9, 0.1], [0.4, 0.6], [0.5, 0.5]]),
    )


def test_rooms_have_place_area_type_and_no_name_at_first():
    first, second = room_places(_rooms(), ())
    assert (first.kind, second.kind) == ("kitchen", "")
    assert first.area_m2 == pytest.approx(15 * 10 * 0.04)
    assert 0.8 < first.x_m < 2.2
    assert 0.8 < first.y_m < 1.2
    assert first.name == second.name == ""


def test_a_name_belongs_to_the_room_of_its_point():
    names = renamed(_rooms(), (), *OTHER, "Anna's room")
    places = {place.kind: place.name for place in room_places(_rooms(), names)}
    assert places == {"kitchen": "", "": "Anna's room"}
    name_at = name_lookup(_rooms(), names)
    assert name_at(OTHER) == "Anna's room"
    assert name_at(KITCHEN) == "kitchen"
    assert name_at((50.0, 50.0)) == ""


def test_a_second_name_replaces_the_first_and_an_empty_one_removes_it():
    names = renamed(_rooms(), (), *OTHER, "Anna's room")
    names = renamed(_rooms(), names, 5.0, 0.4, "Ben's room")
    assert [one.name for one in names] == ["Ben's room"]
    assert renamed(_rooms(), names, *OTHER, "") == ()


def test_names_hold_when_the_rooms_are_inferred_anew():
    names = renamed(_rooms(), (), *OTHER, "Anna's room")
    changed = _rooms(door=13)
    assert name_lookup(changed, names)((5.0, 1.0)) == "Anna's room"
    just_outside = (RoomName(x_m=4.0, y_m=2.4, name="balcony"),)
    assert "balcony" in [place.name for place in room_places(_rooms(), just_outside)]


def test_there_is_no_room_to_name_far_outside():
    with pytest.raises(ValueError, match=r"there is no room at \(50.0, 1.0\)"):
        renamed(_rooms(), (), 50.0, 1.0, "moon")


def test_a_name_is_of_one_floor():
    upstairs = dataclasses.replace(_rooms(), floor_z_m=3.0)
    names = renamed(_rooms(), (), *OTHER, "Anna's room")
    assert name_lookup(upstairs, names)(OTHER) == ""
    names = renamed(upstairs, names, *OTHER, "Ben's room")
    assert [name_lookup(one, names)(OTHER) for one in (_rooms(), upstairs)] == [
        "Anna's room",
        "Ben's room",
    ]
    names = renamed(upstairs, names, *OTHER, "")
    assert [one.name for one in names] == ["Anna's room"]


def test_a_name_of_an_earlier_version_is_of_any_floor():
    upstairs = dataclasses.replace(_rooms(), floor_z_m=3.0)
    names = (RoomName(x_m=OTHER[0], y_m=OTHER[1], name="Anna's room"),)
    assert name_lookup(upstairs, names)(OTHER) == "Anna's room"
