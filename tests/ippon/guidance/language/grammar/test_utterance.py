import pytest

from ippon.guidance.language.grammar.utterance import hear


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("um find uh the the remote", "find the remote"),
        ("wehre is my hat", "where is my hat"),
        ("an orange orange", "an orange orange"),
        ("plants & candles", "plants and candles"),
        ('a 55" tv', "a 55 inch tv"),
        ("a 1.5 l bottle", "a 1.5 l bottle"),
        ("the kids' room", "the kids's room"),
        ("location: sofa", "at sofa"),
        ("on the table, er, on the shelf", "on the table no on the shelf"),
        ("in the kitchen, um, in the drawer", "in the kitchen in the drawer"),
        ("find the what's it called the tin opener", "find the tin opener"),
        ("my no wait the other charger", "the other charger"),
        ("two no three chairs", "three chairs"),
        ("outta teh garage", "out of the garage"),
    ],
)
def test_words(text, words):
    heard = hear(text)
    assert " ".join(heard.words(0, len(heard))) == words


def test_what_stands_between_words():
    heard = hear("hat, mug. Sofa")
    assert [heard.breaks(n) for n in range(3)] == [False, True, True]
    assert [heard.ends(n) for n in range(4)] == [False, False, True, True]
    assert heard.said(0, 2) == "hat, mug"
