"""Lists of objects, and what is said of all of them."""

import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("sentence", "goals"),
    [
        ("look for the cup and for the book", [("cup", "and"), ("book", "and")]),
        ("search for the cup, then for a book", [("cup", "and"), ("book", "then")]),
        (
            "Please look for the remote control, after that for a pillow and then a chair",
            [("remote control", "and"), ("pillow", "then"), ("chair", "then")],
        ),
    ],
)
def test_a_verb_with_for_holds_for_each_object(sentence: str, goals: list[tuple[str, str]]) -> None:
    read = read_request(sentence).goals
    assert [(goal.object, goal.order) for goal in read] == goals
    assert not any(goal.attributes for goal in read)


def test_what_one_object_is_for_is_no_second_object() -> None:
    (goal,) = read_request("look for a cushion for the sofa and for the armchair").goals
    assert [one.value for one in goal.attributes] == ["for the sofa", "for the armchair"]


@pytest.mark.parametrize(
    "said", ["at the same time", "at once", ", both at once", "simultaneously", "in one go"]
)
def test_that_a_list_is_searched_for_at_the_same_time_is_no_object(said: str) -> None:
    request = read_request(f"find the cup and the book {said}")
    assert [goal.object for goal in request.goals] == ["cup", "book"]
    assert not request.because
