"""Names as rmw_zenoh writes them: types, key expressions, and names within tokens."""

import re
from functools import cache
from typing import Final

from app.messages.cdr import typestore

NO_HASH: Final = "TypeHashNotSupported"
"""In place of the hash with ROS 2 Humble, whose messages have none."""
_DDS_TYPE: Final = re.compile(r"(\w+)::(\w+)::dds_::(\w+)_")
_ROS_TYPE: Final = re.compile(r"(\w+)/(\w+)/(\w+)")


def dds_type(ros_type: str) -> str:
    """Return `sensor_msgs::msg::dds_::Image_` of `sensor_msgs/msg/Image`.

    Raises:
        ValueError: Not a type of ROS 2.
    """
    match = _ROS_TYPE.fullmatch(ros_type)
    if match is None:
        raise ValueError(f"a ROS 2 type is PACKAGE/KIND/NAME; got {ros_type!r}")
    return "{}::{}::dds_::{}_".format(*match.groups())


def ros_type(dds_name: str) -> str:
    """Return the ROS 2 type of a DDS type's name; other names as they are."""
    match = _DDS_TYPE.fullmatch(dds_name)
    return dds_name if match is None else "/".join(match.groups())


def topic_key(domain: int, topic: str, kind: str, type_hash: str) -> str:
    """Return the key expression of a topic's messages.

    Args:
        domain: ROS domain.
        topic: Full name, such as `/scout/odom`.
        kind: ROS 2 type.
        type_hash: From `type_hash`, or `NO_HASH`.
    """
    return f"{domain}/{topic.strip('/')}/{dds_type(kind)}/{type_hash}"


def mangled(name: str) -> str:
    """Return a name as one part of a token; the empty one and `/` are `%`."""
    return name.replace("/", "%") or "%"


def demangled(part: str) -> str:
    """Return the name in a part of a token."""
    return part.replace("%", "/")


@cache
def type_hash(kind: str) -> str:
    """Return the RIHS01 hash of a message type that this program knows.

    It covers the names and types of all fields, nested ones included (REP 2016).

    Raises:
        KeyError: The type is unknown here.
    """
    return str(typestore().hash_rihs01(kind))
