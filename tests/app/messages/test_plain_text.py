"""Text that people typed."""

import pytest

from app.messages.plain_text import complaint


@pytest.mark.parametrize(
    "text", ["hat", "", "<b>hat</b>", "帽子", "قبعة", "👩‍🔧", "two\nlines\tand a tab", "é" * 2000]
)
def test_what_people_write_is_fine(text):
    assert complaint("the object", text) is None


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("h\x00at", "U+0000, at position 2"),
        ("\x1b[31mhat", "U+001B, at position 1"),
        ("hat\x7f", "U+007F, at position 4"),
        ("hat\u202etah", "U+202E, at position 4"),
    ],
)
def test_control_characters_are_named(text, where):
    assert complaint("the object", text) == (
        f"the object holds a control character ({where}); type it again with letters"
    )
