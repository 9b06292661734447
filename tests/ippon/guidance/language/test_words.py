import sys

import pytest
import typeguard

from ippon.guidance.language import words
from ippon.guidance.language.words import generic, is_many, plain, singular, tokenize, with_article


@pytest.mark.parametrize(
    ("plural", "single"),
    [
        ("hats", "hat"),
        ("gazebos", "gazebo"),
        ("boxes", "box"),
        ("knives", "knife"),
        ("cherries", "cherry"),
        ("mice", "mouse"),
        ("compass", "compass"),
        ("bus", "bus"),
        ("glasses", "glasses"),
        ("iris", "iris"),
        ("canvas", "canvas"),
    ],
)
def test_singular(plural: str, single: str) -> None:
    assert singular(plural) == single


def test_only_the_library_of_inflections_goes_without_type_checks(monkeypatch):
    monkeypatch.delitem(sys.modules, "inflect", raising=False)
    checked = typeguard.typechecked
    library = words._inflection.__wrapped__()
    assert library.singular_noun("gazebos") == "gazebo"
    # A checked method would refuse what is no string with an error of typeguard's own.
    with pytest.raises(TypeError):
        library.singular_noun(5)
    assert typeguard.typechecked is checked


def test_generic_statements_agree_in_number() -> None:
    assert generic("hat") == "hats are"
    assert generic("toilet paper") == "toilet paper is"
    assert generic("reading glasses") == "reading glasses are"
    assert generic("dining table") == "dining tables are"
    assert generic("toothbrush") == "toothbrushes are"
    assert generic("battery") == "batteries are"
    assert generic("shelf") == "shelves are"


def test_articles() -> None:
    assert with_article("armchair") == "an armchair"
    assert with_article("hat") == "a hat"
    assert with_article("shoes") == "shoes"
    assert with_article("umbrella") == "an umbrella"
    assert with_article("utensil") == "a utensil"
    assert [is_many(phrase) for phrase in ("reading glasses", "hat", "soap")] == [
        True,
        False,
        False,
    ]


def test_tokens_have_their_offsets() -> None:
    text = "It isn’t on the Sofa."
    tokens = tokenize(text)
    assert [token.word for token in tokens] == ["it", "isn't", "on", "the", "sofa"]
    assert text[tokens[4].start : tokens[4].end] == "Sofa"


def test_plain_drops_invisible_characters() -> None:
    assert plain("red\u200b\x00 \uff48at") == "red hat"
