import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("sentence", "objects", "left_out"),
    [
        ("bring the spoon, the soup I have here", ["spoon"], "the soup I have here"),
        ("the mug, the cup we can find ourselves", ["mug"], "the cup we can find ourselves"),
        ("the milk, the cereal I can reach myself", ["milk"], "the cereal I can reach myself"),
        ("a hat and a scarf, but the gloves I've got", ["hat", "scarf"], "but the gloves I've got"),
    ],
)
def test_what_somebody_has_is_not_searched_for(sentence, objects, left_out) -> None:
    request = read_request(sentence)
    assert [goal.object for goal in request.goals] == objects
    assert request.unused == (left_out,)


def test_a_denial_of_what_is_left_out_is_no_attribute() -> None:
    (goal,) = read_request("the kettle, not the tea, the tea I can get myself").goals
    assert not goal.attributes


@pytest.mark.parametrize(
    ("sentence", "objects"),
    [
        ("the spoon, the soup I have lost", ["spoon", "soup"]),
        ("the spoon, the mug I can see", ["spoon", "mug"]),
        ("the soup I have here", ["soup"]),
    ],
)
def test_what_is_missing_or_alone_is_searched_for(sentence: str, objects: list[str]) -> None:
    assert [goal.object for goal in read_request(sentence).goals] == objects
