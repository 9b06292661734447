"""What the operator reads of a navigator of another version."""

import pytest

from app.nodes.console.link.versions import OWN, difference, not_understood
from app.view.words import ENGLISH


def test_the_same_version_is_no_news():
    assert difference(OWN, ENGLISH) == ""
    assert difference("9.9", ENGLISH) == f"The navigator has version 9.9, this console {OWN}."


def test_a_status_of_another_version_says_which():
    text = not_understood(b'{"version":"9.9","mood":"good"}', "status: unknown field", ENGLISH)
    assert text == (
        f"The navigator has version 9.9 and this console {OWN}, which are incompatible. "
        "Install the same version on both."
    )


@pytest.mark.parametrize("status", [b"", b"\xff", b"[]", b'{"version":3}', b'{"mood":"good"}'])
def test_what_is_no_status_says_what_is_wrong(status):
    text = not_understood(status, "status: Expected `object`" + "!" * 1000, ENGLISH)
    assert text.startswith("The navigator's status cannot be read (status: Expected `object`")
    assert len(text) < 400
