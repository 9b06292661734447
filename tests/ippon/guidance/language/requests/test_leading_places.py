import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("sentence", "object_", "places"),
    [
        ("look in the kitchen for my hat", "hat", ["in kitchen"]),
        ("upstairs in the hall: the thermometer", "thermometer", ["in hall", "upstairs"]),
        ("on my desk is a folder", "folder", ["on desk"]),
        ("kitchen: scissors", "scissors", ["in kitchen"]),
        ("anywhere except in the nursery: my phone", "phone", ["not in nursery"]),
        ("search the kitchen and the hall for my keys", "keys", ["in kitchen", "in hall"]),
        ("check the hall first, then the attic, for my hat", "hat", ["in hall", "in attic"]),
        ("look on the top shelf above the bench for the glue", "glue",
         ["on top shelf", "above bench"]),
        ("go round every room and find my hat", "hat", []),
        ("check the fridge in the cellar for milk", "milk", ["in fridge", "in cellar"]),
        ("look between the bed and the wall for my hat", "hat", ["between bed", "between wall"]),
        ("check Tom's room for the ball", "ball", ["in Tom's room"]),
        ("in the server room, find the cable", "cable", ["in server room"]),
        ("I've already searched the car for my hat", "hat", ["not in car"]),
    ],
)  # fmt: skip
def test_places_that_are_said_first(sentence: str, object_: str, places: list[str]) -> None:
    (goal,) = read_request(sentence).goals
    assert goal.object == object_
    assert sorted(place.text for place in goal.relations) == sorted(places)


@pytest.mark.parametrize(
    ("sentence", "places"),
    [
        ("the key isn't on the hook; look behind the door", ["not on hook", "behind door"]),
        ("I need a ladder. Check the garage first.", ["in garage"]),
        ("I think the dog took my hat, look under the bed", []),
        ("my hat is gone, check the time", []),
        ("my hat is gone, look at the dog", []),
    ],
)
def test_where_to_look_is_said_after_the_object(sentence: str, places: list[str]) -> None:
    (goal,) = read_request(sentence).goals
    assert [place.text for place in goal.relations] == places
