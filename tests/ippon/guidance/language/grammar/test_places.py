import pytest

from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.grammar.places import (
    holds_things,
    is_room,
    is_searched_inside,
    named_place,
    room_spelt,
)


@pytest.mark.parametrize(
    ("name", "room"), [("kitchen", True), ("puja room", True), ("sofa", False)]
)
def test_rooms(name: str, room: bool) -> None:
    assert is_room(name) == room


def test_places_that_hold_things() -> None:
    assert [holds_things(name) for name in ("kitchen", "table", "rug", "mug")] == [
        True, True, True, False,
    ]  # fmt: skip


def test_what_is_searched_inside() -> None:
    assert is_searched_inside("kitchen drawer")
    assert not is_searched_inside("table")


def test_a_misspelt_room_is_corrected() -> None:
    assert room_spelt("kichen") == "kitchen"
    assert room_spelt("table") == "table"


@pytest.mark.parametrize(
    ("head", "attribute", "name"),
    [
        ("floor", Attribute(kind="which", value="third"), "third floor"),
        ("room", Attribute(kind="feel", value="cold"), "cold room"),
        ("desk", Attribute(kind="which", value="front"), "front desk"),
        ("closet", Attribute(kind="material", value="linen"), "linen closet"),
        ("drawer", Attribute(kind="which", value="top"), "drawer"),
        ("desk", Attribute(kind="colour", value="white"), "desk"),
    ],
)
def test_the_whole_name_where_the_last_word_is_another_place(
    head: str, attribute: Attribute, name: str
) -> None:
    place, rest = named_place(head, [attribute])
    assert place == name
    assert rest == (() if name != head else (attribute,))
