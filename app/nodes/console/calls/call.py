"""One call for a person."""

from typing import Final, Literal, get_args

import msgspec

CallKind = Literal[
    "found", "perhaps", "out_of_reach", "not_found", "stuck", "lost", "contact", "disk"
]
Verdict = Literal["", "confirmed", "rejected"]
KINDS: Final[tuple[CallKind, ...]] = get_args(CallKind)


class Occasion(msgspec.Struct, frozen=True, kw_only=True):
    """Why a person is needed."""

    kind: CallKind
    text: str
    goal_id: int | None = None
    object: str = ""
    position_world: tuple[float, float, float] | None = None
    """Where a find is, metres."""
    find: int | None = None
    """Number of the find among those of its goal."""


class Call(msgspec.Struct, frozen=True, kw_only=True):
    """An occasion that a person was called for."""

    number: int
    title: str
    occasion: Occasion
    wall_ns: int
    """Clock of the console's machine, nanoseconds since 1970."""
    count: int = 1
    """Occasions of this kind since the last call for it."""
    judged: Verdict = ""
    """What the operator said of the find."""
    webhook: str = ""
    """What became of it at the webhook; empty without one."""
