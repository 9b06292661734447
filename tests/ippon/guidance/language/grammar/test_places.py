import pytest

from ippon.guidance.language.grammar.places import (
    holds_things,
    is_room,
    is_searched_inside,
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
