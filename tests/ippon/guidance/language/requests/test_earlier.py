import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("sentence", "objects"),
    [
        ("before you look for the ladder, find the hammer", ["hammer", "ladder"]),
        ("find the bucket before the mop", ["bucket", "mop"]),
        ("find the cat, but before that find the dog", ["dog", "cat"]),
    ],
)
def test_what_comes_before_is_first(sentence: str, objects: list[str]) -> None:
    request = read_request(sentence)
    assert [goal.object for goal in request.goals] == objects
    assert [goal.order for goal in request.goals] == ["and", "then"]
    assert not request.doubtful


@pytest.mark.parametrize(
    ("sentence", "order"),
    [
        ("after you find the mug, find the spoon", "then"),
        ("when you have got the mug, look for the spoon", "then"),
        ("if you can't find the mug, the spoon is fine", "or"),
    ],
)
def test_what_is_found_first_is_first(sentence: str, order: str) -> None:
    request = read_request(sentence)
    assert [(goal.object, goal.order) for goal in request.goals] == [
        ("mug", "and"),
        ("spoon", order),
    ]


def test_before_an_event_names_no_object() -> None:
    request = read_request("find my keys before the guests arrive")
    assert [goal.object for goal in request.goals] == ["keys"]
    assert request.unused == ("before the guests arrive",)
