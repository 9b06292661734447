import pytest

from ippon.guidance.language.grammar.utterance import hear
from ippon.guidance.language.requests.reader import RequestReader
from ippon.guidance.language.requests.sentence import read_request
from ippon.guidance.language.requests.traces import lost_words


@pytest.mark.parametrize(
    ("sentence", "words"),
    [
        ("plates for six", "six"),
        ("I had it before the party, my hat", "before"),
    ],
)
def test_words_that_change_what_is_meant_make_a_reading_doubtful(sentence: str, words: str) -> None:
    request = read_request(sentence)
    assert request.doubtful
    assert f"“{words}” was not understood" in request.because
    assert words in request.unused


def test_a_name_without_a_trace_is_told() -> None:
    request = read_request("I need my medicine, the white pills in the bathroom cabinet")
    assert "pills" in request.unused
    assert not request.doubtful


@pytest.mark.parametrize(
    "sentence",
    [
        "Find my hat, no, the scarf",
        "two or three cushions",
        "I can't find my keys",
        "either a pen or a pencil",
        "all the mugs except the white ones",
        "half a dozen eggs",
        "find 2 of the 3 chairs",
    ],
)
def test_what_is_taken_back_counted_or_asked_needs_no_trace(sentence: str) -> None:
    reading = RequestReader(hear(sentence)).read()
    assert lost_words(reading) == ([], [])
