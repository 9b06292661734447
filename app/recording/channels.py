"""Mapping between keys and the ROS topics, types and payloads of a recording.

JSON messages are recorded as std_msgs/String: `ros2 bag` refuses bags with mixed serialisations,
and every reader of bags can show a String.
"""

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, Final

from app.messages import keys
from app.messages.cdr import typestore
from app.recording.errors import RecordingError

STRING: Final = "std_msgs/msg/String"
MARKERS_KEY: Final = "plan/markers"
"""Tree and finds as markers, for viewers that lack our message types."""
GAP_KEY: Final = "recording/gap"
"""Messages are missing here (`RecordingGap`), in recordings alone."""
MARKERS_TYPE: Final = "visualization_msgs/msg/MarkerArray"
KEY: Final = "ippon_key"
"""Metadata of a channel: the key under the robot's prefix."""
LATCHED: Final = frozenset((*keys.KEPT, *keys.ON_CHANGE))
"""Topics whose last message a late subscriber of a played recording gets."""
Names = Mapping[tuple[str, str], str]
"""Keys by name and type of the topics of a robot that has names of its own."""
USUAL: Final[Names] = MappingProxyType({})
"""Of a robot without such names."""

_STRING_HEADER: Final = b"\x00\x01\x00\x00"
_NOT_ROS: Final = re.compile(r"[^A-Za-z0-9_/]")
_ROS_VERSION: Final = 2
_NEVER: Final = {"sec": 9223372036, "nsec": 854775807}


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """How one key is recorded."""

    key: str
    name: str
    """Name of the ROS topic."""
    type: str
    schema: str
    """ROS definition of the type and of all types that it contains."""
    type_hash: str
    latched: bool


@cache
def topic_of(robot: str, key: str) -> Topic:
    """Return how a key is recorded."""
    kind = MARKERS_TYPE if key == MARKERS_KEY else keys.ROS_TYPES.get(key, STRING)
    return Topic(
        key=key,
        name=ros_name(f"{robot}/{key}"),
        type=kind,
        schema=ros_schema(kind),
        type_hash=typestore().hash_rihs01(kind),
        latched=key in LATCHED,
    )


def ros_schema(kind: str) -> str:
    """Return the ROS definition of a type and of all types that it contains."""
    return typestore().generate_msgdef(kind, ros_version=_ROS_VERSION)[0]


def ros_name(path: str) -> str:
    """Return a path of keys as the name of a ROS topic: no part begins with a digit."""
    parts = [part for part in _NOT_ROS.sub("_", path).split("/") if part]
    return "/" + "/".join(f"_{part}" if part[0].isdigit() else part for part in parts)


def key_of(name: str, kind: str, metadata: dict[str, str], names: Names = USUAL) -> str | None:
    """Return the key of a recorded topic, None for an unknown topic.

    In bags of other programs, which lack our metadata, the robot's own names decide, and then type
    and end of the name.

    Args:
        name: Of the topic.
        kind: Its type.
        metadata: Of its channel.
        names: Of the robot.
    """
    if KEY in metadata:
        return metadata[KEY]
    if (name, kind) in names:
        return names[name, kind]
    bare, taken = name.strip("/"), set(names.values())
    known = [
        key
        for key, usual in keys.ROS_TYPES.items()
        if usual == kind and key not in taken and (bare == key or bare.endswith("/" + key))
    ]
    return max(known, key=len, default=None)


def to_recorded(topic: Topic, payload: bytes) -> bytes:
    """Return the recorded form of a payload."""
    return payload if topic.type != STRING else encode_text(payload)


def to_wire(kind: str, data: bytes) -> bytes:
    """Return the payload of a recorded message.

    Raises:
        RecordingError: The text cannot be decoded.
    """
    return data if kind != STRING else decode_text(data)


def encode_text(text: bytes) -> bytes:
    """Write a std_msgs/String, as little-endian CDR."""
    return _STRING_HEADER + struct.pack("<I", len(text) + 1) + text + b"\0"


def decode_text(data: bytes) -> bytes:
    """Read a std_msgs/String.

    Raises:
        RecordingError: The data are not a String.
    """
    if len(data) < 9 or data[:2] not in (b"\x00\x01", b"\x00\x00"):
        raise RecordingError(f"{len(data)} bytes are not a std_msgs/String")
    (size,) = struct.unpack_from("<I" if data[1] else ">I", data, 4)
    if not 1 <= size <= len(data) - 8:
        raise RecordingError(f"a std_msgs/String of {size} bytes does not fit in {len(data)}")
    return data[8 : 8 + size - 1]


def quality_of_service(topic: Topic) -> dict[str, Any]:
    """Return the offered quality of service, as rosbag2 stores it."""
    return {
        "history": "keep_last",
        "depth": 1 if topic.latched else 10,
        "reliability": "reliable",
        "durability": "transient_local" if topic.latched else "volatile",
        "deadline": _NEVER,
        "lifespan": _NEVER,
        "liveliness": "automatic",
        "liveliness_lease_duration": _NEVER,
        "avoid_ros_namespace_conventions": False,
    }
