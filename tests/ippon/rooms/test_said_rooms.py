import numpy as np
import pytest

from ippon.rooms.named_rooms import RoomName
from ippon.rooms.room_inference import NO_ROOM, Rooms
from ippon.rooms.said_rooms import (
    SaidRoom,
    SaidRoomConfig,
    is_elsewhere,
    read_said_rooms,
    said_parts,
    weigh_rooms,
)

CONFIG = SaidRoomConfig()
TYPES = ("bathroom", "bedroom", "kitchen", "living_room")
KITCHEN, BEDROOM, UNCLEAR = 1, 2, 3


def _rooms():
    """Three rooms in a row of 2 m: a kitchen, a bedroom, and one without any evidence."""
    part = np.repeat(np.array([[KITCHEN], [BEDROOM], [UNCLEAR]], np.int32), 10, axis=0)
    return Rooms(
        types=TYPES,
        cell_m=0.2,
        origin=np.zeros(2, np.int64),
        part=np.repeat(part, 10, axis=1),
        room=np.array([NO_ROOM, 2, 1, NO_ROOM]),
        probability=np.array(
            [[0.25] * 4, [0.01, 0.0, 0.97, 0.02], [0.0, 0.98, 0.0, 0.02], [0.25] * 4]
        ),
    )


def _named(part, name):
    return RoomName(x_m=2.0 * part - 1.0, y_m=1.0, name=name)


def _weigh(context, *names):
    said = read_said_rooms(context, [one.name for one in names])
    return said, weigh_rooms(said, _rooms(), names, CONFIG)


@pytest.mark.parametrize(
    ("context", "place", "kind", "negated", "firm"),
    [
        ("in the kitchen", "kitchen", "kitchen", False, True),
        ("I left it on the table in the kitchen", "kitchen", "kitchen", False, True),
        ("not in the kitchen", "kitchen", "kitchen", True, True),
        ("anywhere but the bedroom", "bedroom", "bedroom", True, True),
        ("maybe in the bathroom", "bathroom", "bathroom", False, False),
        ("in Anna's room", "anna's room", "", False, True),
        ("in Ben’s bedroom", "ben's bedroom", "bedroom", False, True),
        ("in my room", "my room", "", False, True),
        ("in room 12", "room 12", "", False, True),
        ("not upstairs", "upstairs", "", True, True),
        ("in the snug", "snug", "", False, True),
    ],
)
def test_the_room_of_a_context(context, place, kind, negated, firm):
    (said,) = read_said_rooms(context, ["The snug"])
    assert said == SaidRoom(place=place, kind=kind, negated=negated, firm=firm)


@pytest.mark.parametrize(
    "context",
    ["", "on the table", "next to the kitchen", "not on the table in the kitchen", "I was cooking"],
)
def test_what_is_beside_a_room_says_nothing_of_the_room(context):
    assert read_said_rooms(context) == ()


def test_a_room_that_was_inferred_is_searched_first_and_others_later():
    said, weighed = _weigh("in the kitchen")
    outside, kitchen, bedroom, unclear = weighed.by_part
    assert outside == unclear == 1.0
    assert kitchen > 3.0
    assert bedroom == CONFIG.other_weight > 0.0, "nothing is excluded"
    assert weighed.text == "looks first in: kitchen (inferred from what is there)"
    assert is_elsewhere(said, weighed.by_part, BEDROOM)
    assert not is_elsewhere(said, weighed.by_part, KITCHEN)
    assert not is_elsewhere(said, weighed.by_part, UNCLEAR)
    assert not is_elsewhere(said, weighed.by_part, -1)


def test_a_room_that_is_denied_is_searched_last():
    said, weighed = _weigh("not in the kitchen")
    assert weighed.by_part.tolist() == pytest.approx([1.0, CONFIG.denied_weight, 1.0, 1.0])
    assert weighed.text == "looks last in: kitchen (inferred from what is there)"
    assert not is_elsewhere(said, weighed.by_part, BEDROOM)


@pytest.mark.parametrize(
    "context",
    [
        "it was in the kitchen yesterday but it's not in the kitchen now",
        "used to be in the kitchen but now it is not in the kitchen",
        "it was on the kitchen table, but it's not in the kitchen now",
    ],
)
def test_what_is_said_last_of_a_room_holds(context):
    said, weighed = _weigh(context)
    assert [(one.place, one.negated, one.firm) for one in said] == [("kitchen", True, True)]
    assert weighed.by_part[KITCHEN] == pytest.approx(CONFIG.denied_weight)


@pytest.mark.parametrize("context", ["maybe it isn't in the kitchen", "not usually in the kitchen"])
def test_an_unsure_denial_counts_half(context):
    _, weighed = _weigh(context)
    half = 0.5 * (1.0 + CONFIG.denied_weight)
    assert weighed.by_part.tolist() == pytest.approx([1.0, half, 1.0, 1.0])


def test_a_room_of_a_person_that_is_denied_excludes_no_other_room():
    _, weighed = _weigh("not in Anna's bedroom")
    np.testing.assert_array_equal(weighed.by_part, 1.0)
    assert (weighed.last, weighed.missing) == ((), ("anna's bedroom",))
    _, weighed = _weigh("not in Anna's bedroom", _named(UNCLEAR, "Anna"))
    assert weighed.by_part[UNCLEAR] == CONFIG.denied_weight
    assert weighed.by_part[BEDROOM] == 1.0


@pytest.mark.parametrize("other", ["the guest bedroom", "the small bedroom", "Anna's bedroom"])
def test_one_room_that_is_denied_leaves_its_type(other):
    _, weighed = _weigh(f"in the bedroom, but not in {other}")
    assert weighed.by_part[BEDROOM] > 1.0


def test_a_name_counts_from_when_it_is_given():
    _, before = _weigh("in Anna's room")
    assert (before.by_part == 1.0).all()
    assert before.text == (
        "no room of that name yet: anna's room; used as soon as one is named or recognised"
    )
    for name in ("Anna's room", "Anna"):
        _, after = _weigh("in Anna's room", _named(UNCLEAR, name))
        assert after.by_part[UNCLEAR] == 4.0, "four types, and certain"
        assert after.by_part[KITCHEN] == CONFIG.other_weight
        assert after.text == f"looks first in: {name} (named by you)"


def test_a_given_name_wins_over_the_inferred_type():
    _, weighed = _weigh("in the kitchen", _named(BEDROOM, "Kitchen"))
    assert weighed.by_part[BEDROOM] > 1.0
    assert weighed.by_part[KITCHEN] < 1.0
    _, weighed = _weigh("in the kitchen", _named(KITCHEN, "Old bathroom"))
    assert weighed.by_part[KITCHEN] < 1.0, "its name says that it is none"
    _, weighed = _weigh("in the bathroom", _named(UNCLEAR, "Kids' bathroom"))
    assert weighed.text == "looks first in: Kids' bathroom (named by you)"


def test_a_room_of_a_person_is_of_its_type_until_it_is_named():
    _, weighed = _weigh("in Anna's bedroom")
    assert weighed.by_part[BEDROOM] > 1.0
    assert weighed.first == ("bedroom (inferred from what is there)",)
    assert weighed.missing == ("anna's bedroom",)


def test_a_possibility_counts_less_and_several_rooms_count_each():
    _, sure = _weigh("in the bedroom")
    said, unsure = _weigh("maybe in the bedroom")
    assert 1.0 < unsure.by_part[BEDROOM] < sure.by_part[BEDROOM]
    assert sure.by_part[KITCHEN] < unsure.by_part[KITCHEN] < 1.0
    assert not is_elsewhere(said, unsure.by_part, KITCHEN)
    _, both = _weigh("in the bedroom or in the kitchen")
    assert min(both.by_part[BEDROOM], both.by_part[KITCHEN]) > 1.0


def test_weights_that_exclude_or_invert_are_rejected():
    with pytest.raises(ValueError, match="lie in \\(0, 1\\]"):
        SaidRoomConfig(other_weight=0.0)
    with pytest.raises(ValueError, match="said_weight is finite and at least 1"):
        SaidRoomConfig(said_weight=0.5)


@pytest.mark.parametrize(
    ("context", "names", "parts"),
    [
        ("in the kitchen", (), {KITCHEN: "kitchen"}),
        ("in the kitchen", (_named(UNCLEAR, "Kitchen"),), {UNCLEAR: "Kitchen"}),
        ("in the kitchen", (_named(KITCHEN, "The cave"),), {KITCHEN: "The cave"}),
        ("in the kitchen", (_named(KITCHEN, "Study"),), {}),
        ("in Anna's room", (_named(UNCLEAR, "Anna"),), {UNCLEAR: "Anna"}),
        ("in Anna's bedroom", (), {}),
        ("in the snug", (_named(BEDROOM, "The snug"),), {BEDROOM: "The snug"}),
        ("in the bathroom", (), {}),
        ("not in the kitchen", (), {}),
        ("in the kitchen or in the bedroom", (), {KITCHEN: "kitchen", BEDROOM: "bedroom"}),
    ],
)
def test_the_parts_that_are_the_room_that_was_said(context, names, parts):
    said = read_said_rooms(context, [one.name for one in names])
    assert said_parts(said, _rooms(), names) == parts


def test_a_german_name_is_that_of_the_room_that_was_said_in_english():
    said, weights = _weigh("in Anna's room", _named(UNCLEAR, "Annas Zimmer"))
    assert weights.first == ("Annas Zimmer (named by you)",)
    assert (said[0].place, weights.missing) == ("anna's room", ())
    _, weights = _weigh("in room 12", _named(UNCLEAR, "Zimmer 12"))
    assert weights.first == ("Zimmer 12 (named by you)",)
    _, weights = _weigh("in Anna's room", _named(UNCLEAR, "Bens Zimmer"))
    assert weights.first == ()


def test_a_room_of_another_floor_is_not_said_to_have_no_name():
    attic = RoomName(x_m=1.0, y_m=1.0, name="Anna's room", floor_z_m=3.0)
    _, weights = _weigh("in Anna's room", attic)
    assert weights.missing == ()
    assert weights.text == "on another floor: anna's room; used as soon as the robot is there"
    np.testing.assert_array_equal(weights.by_part, 1.0)
    _, weights = _weigh("in Ben's room", attic)
    assert weights.text.startswith("no room of that name yet: ben's room;")
