import pytest

from ippon.guidance.language.grammar.guesses import is_guessed_before
from ippon.guidance.language.grammar.utterance import hear


@pytest.mark.parametrize(
    ("text", "guessed"),
    [
        ("I may have dropped my ring", True),
        ("maybe Paul took the drill", True),
        ("Dave reckons the tarp", True),
        ("it is possible that the key", True),
        ("could you find my ring", False),
        ("I left my ring", False),
        ("I think so. I left my ring", False),
    ],
)
def test_what_is_said_before_a_word_may_be_a_guess(text: str, guessed: bool) -> None:
    said = hear(text)
    assert is_guessed_before(said, len(said) - 1) == guessed
