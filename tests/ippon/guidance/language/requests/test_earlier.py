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


def test_before_an_event_names_no_object() -> None:
    request = read_request("find my keys before the guests arrive")
    assert [goal.object for goal in request.goals] == ["keys"]
    assert request.unused == ("before the guests arrive",)
