"""A navigator of another version than this console."""

from importlib.metadata import version
from typing import Final

import msgspec

OWN: Final = version("ippon")


class _Versioned(msgspec.Struct):
    """Of a status, only what tells its version: the rest may be anything."""

    version: str = ""


def not_understood(status: bytes, problem: str) -> str:
    """Say why a status could not be read.

    Args:
        status: As it came.
        problem: What the reader says.
    """
    try:
        theirs = msgspec.json.decode(status[: 4 * 2**20], type=_Versioned).version[:40]
    except (msgspec.DecodeError, UnicodeDecodeError):
        theirs = ""
    if theirs and theirs != OWN:
        return (
            f"The navigator is of version {theirs}, this console of {OWN}, and they do not "
            "understand one another. Install the same version on both."
        )
    return f"The navigator is not understood ({problem[:300]})."


def difference(theirs: str) -> str:
    """Say that a navigator that is understood is of another version, "" when it is not."""
    if theirs == OWN:
        return ""
    return f"The navigator is of version {theirs[:40]}, this console of {OWN}."
