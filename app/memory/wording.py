"""Times and places as a person says them."""

from datetime import datetime, timedelta, tzinfo
from typing import Final

_SECOND_NS: Final = 1_000_000_000
_DAYS: Final = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
_MONTHS: Final = (
    "January", "February", "March", "April", "May", "June", "July", "August", "September",
    "October", "November", "December",
)  # fmt: skip


def said_time(at_ns: int, now_ns: int, zone: tzinfo | None = None) -> str:
    """Return when something was: "just now", "12 minutes ago", "yesterday 18:40".

    Args:
        at_ns: Nanoseconds since 1970.
        now_ns: The present, likewise.
        zone: Time zone; None for that of this machine.
    """
    past_s = (now_ns - at_ns) / _SECOND_NS
    if 0.0 <= past_s < 60.0:
        return "just now"
    if 0.0 <= past_s < 3600.0:
        minutes = int(past_s // 60.0)
        return f"{minutes} minute{'s' if minutes > 1 else ''} ago"
    at = datetime.fromtimestamp(at_ns / _SECOND_NS, tz=zone)
    now = datetime.fromtimestamp(now_ns / _SECOND_NS, tz=zone)
    clock = at.strftime("%H:%M")
    days = (now.date() - at.date()) // timedelta(days=1)
    if days == 0:
        return f"today {clock}"
    if days == 1:
        return f"yesterday {clock}"
    if 1 < days < 7:
        return f"{_DAYS[at.weekday()]} {clock}"
    date = f"{at.day} {_MONTHS[at.month - 1]}"
    return f"{date} {clock}" if at.year == now.year else f"{date} {at.year} {clock}"


def said_place(
    room: str, position_world: tuple[float, float, float], floor_z_m: float | None = None
) -> str:
    """Return where something is: "kitchen, at (3.2, 1.0), 0.8 m high".

    Args:
        room: Its room; empty where that is not clear.
        position_world: Metres.
        floor_z_m: Height of the floor that it is on; None where that is not known: "z = 3.8 m".
    """
    x, y, z = position_world
    if floor_z_m is None:
        if room:
            return f"{room}, at ({x:.1f}, {y:.1f}), z = {z:.1f} m"
        return f"at ({x:.1f}, {y:.1f}), z = {z:.1f} m"
    z -= floor_z_m
    if room:
        return f"{room}, at ({x:.1f}, {y:.1f}), {z:.1f} m high"
    return f"at ({x:.1f}, {y:.1f}), {z:.1f} m high"
