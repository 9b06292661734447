import pytest

from ippon.guidance.language.grammar.reordered import in_order


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mop first, bucket second", "mop first, then bucket"),
        ("first the drill, second the saw", "first the drill, then the saw"),
        ("see the shelf? on it there is a vase", "on the shelf there is a vase"),
        ("do you see that box? Inside there is a pen", "in that box there is a pen"),
        ("look in the hall, no, in the attic for my hat", "look in the attic for my hat"),
        ("In the hall, I mean the attic, find my hat", "In the attic, find my hat"),
    ],
)
def test_what_is_said_in_another_order(text: str, said: str) -> None:
    assert in_order(text) == said


@pytest.mark.parametrize(
    "text",
    [
        "the mug, the spoon second",
        "find the first, the second",
        "look for the hat, no, the scarf",
        "in the hall, no, the attic",
        "see the dog? it is on the shelf",
    ],
)
def test_what_keeps_its_order(text: str) -> None:
    assert in_order(text) == text
