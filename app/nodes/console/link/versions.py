"""Version differences between navigator and console."""

from importlib.metadata import version
from typing import Final

import msgspec

OWN: Final = version("ippon")


class _Versioned(msgspec.Struct):
    """The version of a status whose other fields may be unknown."""

    version: str = ""


def not_understood(status: bytes, problem: str) -> str:
    """Return why a status could not be read.

    Args:
        status: Status as received.
        problem: Error of the reader.
    """
    try:
        theirs = msgspec.json.decode(status[: 4 * 2**20], type=_Versioned).version[:40]
    except (msgspec.DecodeError, UnicodeDecodeError):
        theirs = ""
    if theirs and theirs != OWN:
        return (
            f"The navigator has version {theirs} and this console {OWN}, which are incompatible. "
            f"Install the same version on both."
        )
    return f"The navigator's status cannot be read ({problem[:300]})."


def difference(theirs: str) -> str:
    """Return a note if a compatible navigator has another version, else ""."""
    if theirs == OWN:
        return ""
    return f"The navigator has version {theirs[:40]}, this console {OWN}."
