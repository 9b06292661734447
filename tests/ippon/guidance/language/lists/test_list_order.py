import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("sentence", "goals"),
    [
        ("two radios and a torch, the torch first", [("torch", 1, "and"), ("radio", 2, "then")]),
        ("a red mug, a blue mug, the blue mug first", [("mug", 1, "and"), ("mug", 1, "then")]),
        ("three of each: forks and mugs", [("fork", 3, "and"), ("mug", 3, "and")]),
        ("find two of each: hammer and saw", [("hammer", 2, "and"), ("saw", 2, "and")]),
        ("Cups! Six of them please", [("cup", 6, "and")]),
        ("I need pens, about ten of them", [("pen", 10, "and")]),
        ("two forks and mugs, four of each", [("fork", 2, "and"), ("mug", 4, "and")]),
        ("paint, two cans", [("paint", 2, "and")]),
        ("paint, soap, two cans", [("paint", 1, "and"), ("soap", 1, "and"), ("can", 2, "and")]),
        ("mugs, two cans", [("mug", 1, "and"), ("can", 2, "and")]),
    ],
)
def test_what_is_said_of_a_whole_list(sentence: str, goals: list[tuple[str, int, str]]) -> None:
    read = read_request(sentence).goals
    assert [(goal.object, goal.count, goal.order) for goal in read] == goals


def test_the_first_is_chosen_by_its_attributes() -> None:
    first, _ = read_request("a red mug, a blue mug, the blue mug first").goals
    assert [one.value for one in first.attributes] == ["blue"]
