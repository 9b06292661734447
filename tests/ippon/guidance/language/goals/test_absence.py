import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("sentence", "places"),
    [
        ("I keep my hat on the hook but it isn't there", ["not on hook"]),
        ("my glasses are not where I put them, on the shelf", ["not on shelf"]),
        ("the scissors aren't where they should be", []),
        ("there is no soap in the bathroom, find some", ["not in bathroom"]),
        ("I can't find the bin, is it under the sink?", ["under sink"]),
    ],
)
def test_where_it_is_not(sentence: str, places: list[str]) -> None:
    (goal,) = read_request(sentence).goals
    assert [place.text for place in goal.relations] == places
