"""Typed text: its check, and its form as a sentence."""

import unicodedata
from typing import Final

_TURNING: Final = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Bidirectional controls, which change the displayed order of text."""
_WHITE: Final = frozenset("\n\t\r")


def complaint(what: str, text: str) -> str | None:
    """Return what is wrong with a text, None if nothing is.

    Args:
        what: Name of the text for the operator, for example "the object".
        text: Text as received.
    """
    for place, character in enumerate(text, start=1):
        is_control = unicodedata.category(character) == "Cc" and character not in _WHITE
        if is_control or character in _TURNING:
            return (
                f"{what} holds a control character (U+{ord(character):04X}, at position "
                f"{place}); type it again with letters"
            )
    return None


def as_sentence(text: str) -> str:
    """Return a text with a capital letter and a full stop; an empty one as it is."""
    return f"{text[:1].upper()}{text[1:]}{'' if text.endswith('.') else '.'}" if text else ""
