import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("sentence", "places", "context"),
    [
        ("the ball flew over the fence", [], "flew over the fence"),
        ("the blanket is over the chair", ["on chair"], "is over the chair"),
        ("the bag of the lady in room 2", [], "in room 2"),
        ("the keys are in the drawer, not the fridge", ["in drawer", "not in fridge"], "drawer"),
        ("a ball in the far corner", [], "in the far corner"),
        (
            "my hat is in the hall, probably under the coats",
            ["in hall"],
            "probably under the coats",
        ),
    ],
)
def test_which_places_are_stated(sentence: str, places: list[str], context: str) -> None:
    (goal,) = read_request(sentence).goals
    assert [place.text for place in goal.relations] == places
    assert context in goal.context
