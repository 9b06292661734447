import pytest

from ippon.guidance.language.grammar.name_rows import begins_name, stands_beside, unclear_pair
from ippon.guidance.language.grammar.utterance import hear


@pytest.mark.parametrize(
    ("sentence", "begins"),
    [
        ("toothbrush toothpaste and a towel", [1]),
        ("plates cups and forks", [1]),
        ("pen paper scissors", [1, 2]),
        ("the kettle the toaster and the tea", [2]),
        ("three mugs two spoons", [2]),
        ("paper cups and plates", []),
        ("the bike bell and the lamp", []),
        ("toothbrush, toothpaste and a towel", []),
        ("coffee mug", []),
    ],
)
def test_where_another_object_begins_without_a_comma(sentence: str, begins: list[int]) -> None:
    said = hear(sentence)
    assert [index for index in range(1, len(said)) if begins_name(said, index)] == begins


def test_a_row_of_names_is_told_whole() -> None:
    said = hear("find my pen paper scissors please")
    assert stands_beside(said, 3, 4) == "pen paper scissors"
    assert stands_beside(hear("find my coffee mug"), 2, 4) == ""


def test_two_names_in_a_list_may_be_one() -> None:
    assert unclear_pair(hear("hat gloves and scarf"), 0, 2)
    assert not unclear_pair(hear("the hat and the scarf"), 1, 2)
    assert not unclear_pair(hear("the bike bell and the lamp"), 1, 3)
