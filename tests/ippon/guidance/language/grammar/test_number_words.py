import pytest

from ippon.guidance.language.grammar.number_words import in_digits
from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("text", "digits"),
    [
        ("twenty-two cups", "22 cups"),
        ("Twenty two cups", "22 cups"),
        ("two hundred and five screws", "205 screws"),
        ("a hundred screws", "100 screws"),
        ("zero cups", "0 cups"),
        ("the twenty-first chair", "the twenty-first chair"),
        ("twenty one-litre bottles", "twenty one-litre bottles"),
        ("two mugs and one hat", "two mugs and one hat"),
    ],
)
def test_numbers_of_several_words(text: str, digits: str) -> None:
    assert in_digits(text) == digits


@pytest.mark.parametrize(
    ("sentence", "count"),
    [
        ("find twenty-two cups", 22),
        ("two hundred screws", 200),
        ("twenty two, no, thirty-three cups", 33),
    ],
)
def test_they_count_objects(sentence: str, count: int) -> None:
    request = read_request(sentence)
    assert [goal.count for goal in request.goals] == [count]
    assert not request.doubtful


@pytest.mark.parametrize("number", ["0", "zero", "1000", "2,000", "3-4"])
def test_a_number_that_counts_nothing_is_asked_about(number: str) -> None:
    assert read_request(f"find {number} cups").doubtful
