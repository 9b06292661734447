import pytest

from ippon.guidance.language.context import read_context
from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("sentence", "context"),
    [
        ("there is no soap in the bathroom", "not in the bathroom"),
        ("no batteries in the drawer, find some", "not in the drawer"),
        ("find my hat, not in the kitchen, in the hall", "not in the kitchen; in the hall"),
        ("the lamp furthest from the window", "not near window"),
        ("find my hat in the hall", "in the hall"),
    ],
)
def test_the_context_denies_what_the_sentence_denies(sentence: str, context: str) -> None:
    (goal,) = read_request(sentence).goals
    assert goal.context == context
    claims = read_context(goal.context, (), ooi=goal.object).claims
    assert [one.negated for one in claims] == [one.negated for one in goal.relations]


def test_a_place_where_it_is_not_any_more_is_denied() -> None:
    (goal,) = read_request("I always keep my hat in the drawer but they aren't there").goals
    assert all(one.negated for one in read_context(goal.context, (), ooi="hat").claims)
