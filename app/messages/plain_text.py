"""Text that people typed: what must not be in it."""

import unicodedata
from typing import Final

_TURNING: Final = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""They make text read in another order than it is."""
_WHITE: Final = frozenset("\n\t\r")


def complaint(what: str, text: str) -> str | None:
    """Say what is wrong with a text, None when nothing is.

    Args:
        what: How the operator calls it, for example "the object".
        text: As it came.
    """
    for place, character in enumerate(text, start=1):
        is_control = unicodedata.category(character) == "Cc" and character not in _WHITE
        if is_control or character in _TURNING:
            return (
                f"{what} holds a control character (U+{ord(character):04X}, at place {place}); "
                "type it anew in letters"
            )
    return None
