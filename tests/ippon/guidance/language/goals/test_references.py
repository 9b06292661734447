import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    "sentence",
    [
        "my pen is gone, find another",
        "my pen has died, find another one",
        "The pen is broken, bring another one",
    ],
)
def test_another_takes_the_place_of_what_is_gone(sentence: str) -> None:
    (goal,) = read_request(sentence).goals
    assert (goal.object, goal.refers_to) == ("pen", "other")


@pytest.mark.parametrize("sentence", ["my phone is dead, find the charger",
                                      "is the kettle on? find the charger"])  # fmt: skip
def test_what_is_complained_of_is_not_asked_for(sentence: str) -> None:
    assert [goal.object for goal in read_request(sentence).goals] == ["charger"]


def test_two_things_asked_for_are_two() -> None:
    request = read_request("is my phone on the sofa? and find the charger")
    assert [goal.object for goal in request.goals] == ["phone", "charger"]
