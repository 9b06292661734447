"""Names of the levels, as written and as read."""

import pytest

from ippon.guidance.levels import Level


@pytest.mark.parametrize("level", Level)
def test_a_level_is_read_from_its_own_text(level):
    assert level.text == level.name.lower()
    assert Level.parse(f" {level.text.title()} ") is level


def test_an_unknown_level_lists_the_levels():
    with pytest.raises(ValueError, match=r"'close'; the levels are far, average, near, certain"):
        Level.parse("close")
