import pytest

from ippon.guidance.language.goals.adjectives import (
    is_adjective_at,
    read_adjectives,
    read_apposed,
    read_unlisted,
)
from ippon.guidance.language.goals.drafts import Draft, draft
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.utterance import Utterance, hear


def goal_of(said: Utterance) -> Draft:
    phrase = read_noun_phrase(said, 0)
    assert phrase is not None
    return draft(phrase)


def values(goal: Draft) -> list[str]:
    return [("-" if one.negated else "") + one.value for one in goal.attributes]


@pytest.mark.parametrize(
    ("sentence", "start", "end", "found"),
    [
        ("the mug is dark blue and heavy", 3, 7, ["dark blue", "heavy"]),
        ("the mug is blue paint", 3, 0, []),
        ("the mug is next to the sink", 3, 0, []),
    ],
)
def test_adjectives_that_stand_alone(sentence: str, start: int, end: int, found: list[str]) -> None:
    said = hear(sentence)
    goal = goal_of(said)
    assert read_adjectives(said, start, goal, negated=False) == end
    assert values(goal) == found


def test_an_adjective_of_no_table_ends_its_clause() -> None:
    said = hear("a blanket that isn't scratchy please")
    goal = goal_of(said)
    assert read_unlisted(said, 4, goal, negated=True) == 5
    assert values(goal) == ["-scratchy"]
    assert read_unlisted(hear("a blanket that isn't scratchy wool"), 4, goal, negated=True) == 0


def test_an_adjective_between_commas() -> None:
    said = hear("a beaker, unscratched, and a flask")
    goal = goal_of(said)
    assert read_apposed(said, 2, goal) == 3
    assert values(goal) == ["unscratched"]
    assert read_apposed(hear("a beaker, Emily"), 2, goal) == 2


def test_a_preposition_is_no_adjective() -> None:
    said = hear("clean right next to the sink")
    assert [is_adjective_at(said, index) for index in range(2)] == [True, False]
