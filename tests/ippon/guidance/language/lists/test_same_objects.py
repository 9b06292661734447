"""Names of one object in one sentence are one goal, and what differs stays apart."""

import pytest

from ippon.guidance.language.lists.same_objects import once_each
from ippon.guidance.language.requests.sentence import read_request


def names(sentence):
    return [goal.display for goal in once_each(read_request(sentence).goals)[0]]


def test_three_names_of_one_thing_are_one_goal_and_are_said_to_be():
    goals, notes = once_each(read_request("find my tv, television and telly").goals)
    assert [goal.display for goal in goals] == ["tv"]
    assert notes == (
        "“television” means the same as “tv”: it is searched for once",
        "“telly” means the same as “tv”: it is searched for once",
    )


@pytest.mark.parametrize(
    ("sentence", "left"),
    [
        ("find the couch, the sofa and my keys", ["couch", "keys"]),
        ("find the tv and television in the living room", ["tv"]),
        ("find the tv or the telly", ["tv"]),
        ("find the tv, then the keys, then the television", ["tv", "keys"]),
        ("find all sofas and all couches", ["sofas"]),
    ],
)
def test_another_name_is_no_other_goal(sentence, left):
    assert names(sentence) == left


def test_a_name_that_is_said_twice_is_one_goal():
    goals, notes = once_each(read_request("find the mug and the mug").goals)
    assert [goal.display for goal in goals] == ["mug"]
    assert notes == ("“mug” was said more than once: it is searched for once",)


@pytest.mark.parametrize(
    "sentence",
    [
        "find the red mug and the blue mug",
        "find a couch and a red sofa",
        "find two sofas and a couch",
        "find two sofas and two couches",
        "find my phone and my wife's phone",
        "find a mug and another mug",
        "find the tv in the kitchen and the television in the bedroom",
        "find the mug and the cup",
        "find my trainers and my sneakers",
    ],
)
def test_what_is_told_apart_stays_two_goals(sentence):
    goals = read_request(sentence).goals
    assert len(goals) == 2
    assert once_each(goals) == (goals, ())
