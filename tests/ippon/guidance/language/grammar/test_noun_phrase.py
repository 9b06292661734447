import pytest

from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.utterance import hear


def phrase(text):
    return read_noun_phrase(hear(text), 0)


@pytest.mark.parametrize(
    ("text", "head", "attributes"),
    [
        ("red wine glass", "red wine glass", []),
        ("a red glass", "glass", [("colour", "red")]),
        ("the orange", "orange", []),
        ("an orange mug", "mug", [("colour", "orange")]),
        ("Mr Brown's dark green coat", "coat", [("owner", "Mr Brown"), ("colour", "dark green")]),
        ("a 1.5 litre bottle", "bottle", [("size", "1.5 litre")]),
        ('a 55" tv', "tv", [("size", "55 inch")]),
        ("black and white cats", "cat", [("colour", "black"), ("colour", "white")]),
        ("a leather sofa", "sofa", [("material", "leather")]),
        ("a cup of coffee", "cup", [("content", "coffee")]),
        ("a gren mug", "mug", [("colour", "green")]),
        ("a green can", "can", [("colour", "green")]),
        ("a two-way radio", "radio", [("other", "two-way")]),
        ("the top left drawer", "drawer", [("which", "top"), ("which", "left")]),
        ("the hidden egg", "egg", [("other", "hidden")]),
        ("an M8 bolt", "bolt", [("which", "m8")]),
    ],
)
def test_what_describes_a_thing_is_told_from_its_name(text, head, attributes):
    read = phrase(text)
    assert read.head == head
    assert [(one.kind, one.value) for one in read.attributes] == attributes


@pytest.mark.parametrize(
    ("text", "head", "count"),
    [
        ("two chairs", "chair", 2),
        ("all of the cups", "cup", "all"),
        ("a couple of pillows", "pillow", 2),
        ("half a dozen eggs", "egg", 6),
        ("four glasses", "glass", 4),
        ("my glasses", "glasses", None),
        ("a 10 mm wrench", "wrench", None),
        ("a pair of scissors", "scissors", None),
    ],
)
def test_counts(text, head, count):
    read = phrase(text)
    assert (read.head, read.count) == (head, count)


def test_another_is_one_other_than_before():
    assert phrase("another pillow").reference == "other"
    assert phrase("the blue one").head == ""


@pytest.mark.parametrize("text", ["it", "i left", "of", "on the sofa", ""])
def test_no_noun_phrase(text):
    assert phrase(text) is None
