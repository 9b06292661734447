"""Messages of the control lease: who has control of the robot."""

import hashlib
from typing import Annotated, Literal

from msgspec import Meta, Struct

SessionText = Annotated[str, Meta(min_length=16, max_length=64, pattern=r"^[A-Za-z0-9_-]+$")]
NameText = Annotated[str, Meta(min_length=1, max_length=40, pattern=r"^[^\x00-\x1f\x7f]+$")]


class Credential(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Identity of the requester: JSON attachment of a request.

    A request without one is accepted while nobody has control, and refused otherwise.
    """

    session: SessionText
    """Random secret of the requester, never published; `sender_of` names it in public."""
    name: NameText
    """Name shown to others while this requester has control."""
    epoch: int = 0
    """Epoch of the session's lease, 0 without one."""


def sender_of(session: str) -> str:
    """Return the `sender` of teleoperation messages: all who watch may read those.

    Args:
        session: Session of the credential that holds the lease.

    Returns:
        SHA-256 of the session, in hexadecimal: it names the session, and is no credential.
    """
    return hashlib.sha256(session.encode()).hexdigest()


class LeaseRequest(
    Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """Request, keep or pass on control: key `lease`, with a `Credential` attached."""

    action: Literal["request", "renew", "release", "grant", "deny"]
    """`request` takes a free lease or asks its holder; `renew`, twice per second, keeps a lease or
    a request; `release` gives up either; `grant` and `deny` answer the requester."""
    requester: Annotated[str, Meta(max_length=40)] = ""
    """Name of the requester that `grant` and `deny` answer, refused when another one asks by now;
    empty for whoever asks."""


class TakeRequest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Take control from its holder: key `lease/take`, with a `Credential` attached.

    For supervisors; the console's login and zenoh's access control restrict the key.
    """


class LeaseReply(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Reply to a `LeaseRequest` or `TakeRequest`: the requester's present standing."""

    standing: Literal["holds", "waits", "denied", "watches"]
    epoch: int
    """Epoch of the present lease."""
    detail: str
    """One line for the operator."""


class LeaseStatus(Struct, frozen=True, kw_only=True):
    """Who has control; public."""

    state: Literal["free", "held", "stale"] = "free"
    """`stale`: the holder has been silent briefly; the lease expires soon."""
    holder: str = ""
    requester: str = ""
    """Name of the requester of control."""
    epoch: int = 0
    """Number of leases so far."""
