import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    ("sentence", "places"),
    [
        ("find the sofa and the bag behind it", ["behind sofa"]),
        ("the red chair and the rug that lies under it", ["under red chair"]),
        ("go to the sofa and find the cushion next to it", ["next to sofa"]),
    ],
)
def test_a_pronoun_names_the_place_before(sentence: str, places: list[str]) -> None:
    assert [place.text for place in read_request(sentence).goals[-1].relations] == places


def test_without_a_place_before_a_pronoun_names_none() -> None:
    request = read_request("find the bag behind it")
    assert request.doubtful
    assert "behind it" in request.because
