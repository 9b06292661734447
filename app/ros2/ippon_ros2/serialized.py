"""What the bridge reads of serialized messages (CDR) without decoding them."""

from __future__ import annotations

import math
import struct

FARTHEST_M = 1e6


def stamp_of(payload: bytes) -> float | None:
    """Return the stamp of a serialized message that begins with a header, seconds; None if cut."""
    if len(payload) < 12:
        return None
    order = "<" if payload[1] & 1 else ">"
    seconds, nanoseconds = struct.unpack_from(f"{order}iI", payload, 4)
    return float(seconds) + 1e-9 * float(nanoseconds)


def stamp_bytes_of(payload: bytes) -> bytes:
    """Return the 8 bytes of the stamp of a little-endian message; empty for another one.

    They tell goals apart exactly, which a number of seconds does not.
    """
    return payload[4:12] if len(payload) >= 12 and payload[:2] == b"\x00\x01" else b""


def goal_status(stamp: bytes, status: int) -> bytes:
    """Return a serialized action_msgs/GoalStatus.

    Args:
        stamp: Of the goal, from `stamp_bytes_of`.
        status: As the message defines them: 1 accepted, 4 reached, 5 cancelled, 6 failed.
    """
    return b"\x00\x01\x00\x00" + bytes(16) + stamp + struct.pack("<b", status)


def velocity_of(payload: bytes) -> tuple[float, float, float]:
    """Return stamp (s), forward speed (m/s) and turn (rad/s) of a serialized TwistStamped.

    Raises:
        ValueError: It is none, or holds numbers that are not finite.
    """
    numbers = _numbers_of(payload, 6, "a TwistStamped")
    return float(stamp_of(payload) or 0.0), numbers[0], numbers[5]


def check_pose(payload: bytes) -> None:
    """Refuse what is no PoseStamped that a robot can drive to.

    Raises:
        ValueError: It is none, its numbers are not finite or far off, or its turn is no rotation.
    """
    numbers = _numbers_of(payload, 7, "a PoseStamped")
    if max(map(abs, numbers[:3])) > FARTHEST_M:
        raise ValueError(f"a place beyond {FARTHEST_M:g} m")
    if abs(math.hypot(*numbers[3:]) - 1.0) > 0.01:
        raise ValueError("a rotation is a unit quaternion")


def _numbers_of(payload: bytes, count: int, kind: str) -> tuple[float, ...]:
    """Return the numbers after a header, which are all that follows it."""
    if not 20 <= len(payload) <= 4096 or payload[:2] not in (b"\x00\x00", b"\x00\x01"):
        raise ValueError(f"not {kind}: {len(payload)} bytes")
    order = "<" if payload[1] & 1 else ">"
    (length,) = struct.unpack_from(f"{order}I", payload, 12)
    start = 4 + (12 + length + 7) // 8 * 8
    if len(payload) != start + 8 * count:
        raise ValueError(f"not {kind}: {len(payload)} bytes with a name of {length}")
    numbers = struct.unpack_from(f"{order}{count}d", payload, start)
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"{kind} with numbers that are not finite")
    return numbers
