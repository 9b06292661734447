import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    "sentence",
    [
        "Let's start simple: find a bottle",
        "A harder one: the bottle",
        "And now for something difficult, a bottle",
        "Find the bottle, dear",
        "find the bottle thx",
        "It's cold in here, find a bottle",
    ],
)
def test_what_only_announces_or_addresses_is_no_object(sentence: str) -> None:
    (goal,) = read_request(sentence).goals
    assert (goal.object, goal.attributes) == ("bottle", ())


@pytest.mark.parametrize(
    ("sentence", "object_", "places"),
    [("Kitchen: the bottle", "bottle", ["in kitchen"]), ("Bottle: the green one", "bottle", [])],
)
def test_what_is_named_before_a_colon_is_kept(
    sentence: str, object_: str, places: list[str]
) -> None:
    (goal,) = read_request(sentence).goals
    assert goal.object == object_
    assert [place.text for place in goal.relations] == places


@pytest.mark.parametrize("sentence", ["good night", "bye", "well done, that's all", "no thanks"])
def test_farewell_asks_for_nothing(sentence: str) -> None:
    request = read_request(sentence)
    assert (request.goals, request.doubtful) == ((), True)
