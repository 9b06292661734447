"""Who holds control of the robot: the messages of the lease."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

SessionText = Annotated[str, Meta(min_length=16, max_length=64, pattern=r"^[A-Za-z0-9_-]+$")]
NameText = Annotated[str, Meta(min_length=1, max_length=40, pattern=r"^[^\x00-\x1f\x7f]+$")]


class Credential(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Who asks: attached to a request, as JSON.

    A request without one is taken while nobody holds control, and refused otherwise.
    """

    session: SessionText
    """Drawn at random by whoever wants control, known to nobody else and never published."""
    name: NameText
    """What others read when this one holds control."""
    epoch: int = 0
    """Of the lease that the session was given, 0 when it has none."""


class LeaseRequest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Ask for control, keep it, hand it on: key `lease`, with a `Credential` attached."""

    action: Literal["request", "renew", "release", "grant", "deny"]
    """`request` asks the holder, and takes what is free; `renew`, twice a second, keeps a lease or
    a request alive; `release` gives up either; `grant` and `deny` answer whoever asks."""


class TakeRequest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Take control from its holder: key `lease/take`, with a `Credential` attached.

    For supervisors: who may use the key is a rule of the console's login and of zenoh's access
    control.
    """


class LeaseReply(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Reply to a `LeaseRequest` or `TakeRequest`: how the one who asked stands now."""

    standing: Literal["holds", "waits", "denied", "watches"]
    epoch: int
    """Of the lease as it is now; it is the asker's own where they hold it."""
    detail: str
    """One line for the operator."""


class LeaseStatus(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Who holds control, for all to see."""

    state: Literal["free", "held", "stale"] = "free"
    """`stale`: the holder has not been heard of for a moment; the lease runs out soon."""
    holder: str = ""
    requester: str = ""
    """Who asks the holder for control."""
    epoch: int = 0
    """Counts the holders."""
