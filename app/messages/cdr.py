"""CDR encoding of ROS 2 messages, and the error for invalid bytes."""

import struct
from functools import cache
from importlib import resources
from typing import Any, Final

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MAX_PAYLOAD_BYTES: Final = 64 * 2**20
_NS: Final = 1_000_000_000
_OWN_PACKAGES: Final = ("ippon_msgs", "vision_msgs")


class MessageError(Exception):
    """A payload is not a valid message of its key; the text says what is wrong."""


@cache
def typestore() -> Any:
    """Return the ROS 2 Jazzy type store with the message types of this program."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types: dict[str, Any] = {}
    root = resources.files("app.messages") / "msg"
    for package in _OWN_PACKAGES:
        for definition in sorted((root / package).iterdir(), key=lambda item: item.name):
            name = f"{package}/msg/{definition.name.removesuffix('.msg')}"
            types.update(get_types_from_msg(definition.read_text("utf-8"), name))
    store.register(types)
    return store


def make(typename: str, **fields: Any) -> Any:
    """Build one message, for example `make("std_msgs/msg/Bool", data=True)`."""
    return typestore().types[typename](**fields)


def encode(typename: str, **fields: Any) -> bytes:
    """Build one message and write it as little-endian CDR with its 4-byte header."""
    return bytes(typestore().serialize_cdr(make(typename, **fields), typename))


def decode(payload: bytes, typename: str, *, max_bytes: int = MAX_PAYLOAD_BYTES) -> Any:
    """Read one message; arrays in it are read-only views of the payload.

    Args:
        payload: CDR with its 4-byte header.
        typename: Full ROS 2 name, for example "sensor_msgs/msg/Image".
        max_bytes: Longer payloads are refused unread.

    Raises:
        MessageError: The bytes are not such a message.
    """
    if len(payload) > max_bytes:
        raise MessageError(
            f"{typename}: {len(payload)} bytes came, at most {max_bytes} are accepted"
        )
    try:
        return typestore().deserialize_cdr(payload, typename)
    except (SerdeError, struct.error, ValueError, IndexError, OverflowError) as error:
        raise MessageError(f"not a {typename} ({len(payload)} bytes): {error}") from error


def header(stamp_ns: int, frame_id: str) -> Any:
    """Build a std_msgs/Header from nanoseconds."""
    sec, nanosec = divmod(stamp_ns, _NS)
    stamp = make("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)


def stamp_ns_of(message_header: Any) -> int:
    """Return the stamp of a std_msgs/Header in nanoseconds.

    Raises:
        MessageError: A negative time, or a fraction of a whole second or more.
    """
    sec, nanosec = message_header.stamp.sec, message_header.stamp.nanosec
    if sec < 0 or nanosec >= _NS:
        raise MessageError(f"a stamp of {sec} s and {nanosec} ns is not a time")
    return sec * _NS + nanosec
