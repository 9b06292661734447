import pytest

from ippon.rooms.room_names import is_same_name, kind_of_name, known_rooms, plain_name


def test_the_names_of_rooms_are_neither_types_nor_things():
    names = ["Lager", "Annas Zimmer", "Kitchen", "Sofa"]
    assert known_rooms("in Anna's room", names) == {"lager", "annas zimmer", "anna's room"}


@pytest.mark.parametrize(
    ("given", "place", "same"),
    [
        ("Anna's bedroom", "anna's bedroom", True),
        ("Annas Zimmer", "anna's room", True),
        ("Zimmer 12", "room 12", True),
        ("Anna", "anna's bedroom", True),
        ("Anna's kitchen", "anna's bedroom", False),
        ("Ben's bedroom", "anna's bedroom", False),
    ],
)
def test_a_name_is_that_of_the_place_that_was_said(given, place, same):
    assert is_same_name(plain_name(given), place, kind_of_name(place)) is same
