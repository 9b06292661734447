import pytest

from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.grammar.utterance import hear
from ippon.guidance.language.requests.told import read_told


@pytest.mark.parametrize(
    ("sentence", "object_", "context"),
    [
        ("I left my phone in the kitchen", "phone", ["in the kitchen"]),
        ("the kids were playing with the torch", "torch", ["the kids were playing with"]),
        ("Perhaps", None, []),
        ("we were eating at the table", None, []),
        ("I was cleaning the kitchen", None, []),
        ("I was reading the atlas, where are my glasses", None, []),
    ],
)
def test_what_somebody_did_with_an_object(
    sentence: str, object_: str | None, context: list[str]
) -> None:
    reading = Reading(hear(sentence))
    end = read_told(reading, 0)
    assert (end > 0) == (object_ is not None)
    assert [goal.head for goal in reading.drafts] == [object_] * (object_ is not None)
    assert [words for goal in reading.drafts for words in goal.context] == context


def test_of_two_objects_that_were_used_the_second_is_not_certain() -> None:
    reading = Reading(hear("Dad was fixing the bike with the small wrench"))
    read_told(reading, 0)
    assert reading.unused == ["Dad was fixing"]
