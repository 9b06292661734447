"""Version differences between navigator and console."""

from importlib.metadata import version
from typing import Final

import msgspec

from app.messages.control import decode
from app.view.words import Words

OWN: Final = version("ippon")


class _Versioned(msgspec.Struct):
    """The version of a status whose other fields may be unknown."""

    version: str = ""


def not_understood(status: bytes, problem: str, say: Words) -> str:
    """Return why a status could not be read.

    Args:
        status: Status as received.
        problem: Error of the reader.
        say: The words.
    """
    try:
        theirs = decode(status[: 4 * 2**20], _Versioned).version[:40]
    except msgspec.DecodeError:
        theirs = ""
    if theirs and theirs != OWN:
        return say("link.incompatible", theirs=theirs, own=OWN)
    return say("link.unreadable", problem=problem[:300])


def difference(theirs: str, say: Words) -> str:
    """Return a note if a compatible navigator has another version, else ""."""
    if theirs == OWN:
        return ""
    return say("link.versions", theirs=theirs[:40], own=OWN)
