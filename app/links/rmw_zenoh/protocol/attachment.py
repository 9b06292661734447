"""What rmw_zenoh attaches to each message: its number, time and publisher."""

import struct
from dataclasses import dataclass
from typing import Final

import xxhash

from app.messages.cdr import MessageError

_GID_BYTES: Final = 16
_LAYOUT: Final = struct.Struct(f"<qqB{_GID_BYTES}s")
_NAMED: Final = struct.Struct(f"<16sq17sq11sB{_GID_BYTES}s")
"""With the name of each value before it, as before April 2025."""
_NAMES: Final = (b"\x0fsequence_number", b"\x10source_timestamp", b"\x0asource_gid")


@dataclass(frozen=True, slots=True, kw_only=True)
class Attachment:
    """Attachment of one message."""

    sequence: int
    """Number of the message, counted by its publisher from 1."""
    stamp_ns: int
    """When it was published, by the clock of its publisher."""
    gid: bytes
    """(16) identifies the publisher."""


def gid_of(token: str) -> bytes:
    """Return the identifier of a publisher by its token: the token's XXH3-128."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(_GID_BYTES, "little")


def encode_attachment(attachment: Attachment) -> bytes:
    """Return 33 bytes; a subscription of rmw_zenoh drops messages without them."""
    return _LAYOUT.pack(attachment.sequence, attachment.stamp_ns, _GID_BYTES, attachment.gid)


def decode_attachment(payload: bytes) -> Attachment:
    """Read an attachment, of older versions of rmw_zenoh, too.

    Raises:
        MessageError: It is none.
    """
    if len(payload) == _LAYOUT.size:
        sequence, stamp_ns, length, gid = _LAYOUT.unpack(payload)
        names = _NAMES
    elif len(payload) == _NAMED.size:
        first, sequence, second, stamp_ns, third, length, gid = _NAMED.unpack(payload)
        names = first, second, third
    else:
        raise MessageError(f"an attachment of rmw_zenoh has 33 bytes; got {len(payload)}")
    if length != _GID_BYTES or names != _NAMES:
        raise MessageError("not an attachment of rmw_zenoh")
    return Attachment(sequence=sequence, stamp_ns=stamp_ns, gid=gid)
