import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    "said",
    [
        "Hang on Mike, give me a sec, I'm talking to the robot.",
        "Sorry Maria, not you, the robot.",
        "One moment love, Grandma's talking to the machine.",
        "Oh bother,",
        "Kids, be quiet!",
        "Give me a minute, I'm on the phone.",
    ],
)
def test_what_is_said_to_others_names_no_object(said: str) -> None:
    request = read_request(f"{said} Find the red mug")
    assert [goal.display for goal in request.goals] == ["red mug"]
    assert not request.doubtful


def test_a_word_that_may_be_a_thing_is_shown() -> None:
    request = read_request("sorry, doohickey, find the red mug")
    assert request.unused == ("doohickey",)


@pytest.mark.parametrize("sentence", ["hang on, a mug and the hat", "sorry, the mug. Find a hat"])
def test_a_thing_is_not_taken_for_a_person(sentence: str) -> None:
    assert [goal.object for goal in read_request(sentence).goals] == ["mug", "hat"]


def test_without_a_request_behind_it_nothing_is_skipped() -> None:
    request = read_request("hang on, gizmo")
    assert request.doubtful
