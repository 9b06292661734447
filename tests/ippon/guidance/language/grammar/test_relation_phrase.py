import pytest

from ippon.guidance.language.grammar.relation_phrase import read_relation
from ippon.guidance.language.grammar.utterance import hear


def relations(text):
    read = read_relation(hear(text), 0)
    assert read is not None
    return [
        (one.relation, one.place, one.negated, [what.value for what in one.attributes])
        for one in read.relations
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("next to the white fridge", [("next to", "fridge", False, ["white"])]),
        ("not in the kitchen", [("in", "kitchen", True, [])]),
        ("isn't on the table", [("on", "table", True, [])]),
        ("anywhere but in the bedroom", [("in", "bedroom", True, [])]),
        ("in Anna's room", [("in", "Anna's room", False, [])]),
        (
            "isn't in the car or in the hall",
            [("in", "car", True, []), ("in", "hall", True, [])],
        ),
        ("not upstairs", [("at", "upstairs", True, [])]),
        ("on or under the bed", [("on", "bed", False, []), ("under", "bed", False, [])]),
        ("to the left of the desk", [("next to", "desk", False, [])]),
        ("in the bedrom", [("in", "bedroom", False, [])]),
        (
            "between the sofa and the window",
            [("between", "sofa", False, []), ("between", "window", False, [])],
        ),
    ],
)
def test_places(text, expected):
    assert relations(text) == expected


def test_what_is_likely_is_soft():
    assert read_relation(hear("probably on the sofa"), 0).soft
    assert not read_relation(hear("lying on the sofa"), 0).soft


@pytest.mark.parametrize("text", ["in the morning", "for the party", "hat", "with a handle", "on"])
def test_no_place(text):
    assert read_relation(hear(text), 0) is None
