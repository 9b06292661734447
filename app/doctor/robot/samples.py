"""What a robot sends in a few seconds, with the time of each arrival."""

import struct
import threading
import time
from dataclasses import dataclass, field
from typing import Any, Final

import zenoh

from app.links.network.subscription import subscribe
from app.messages import keys

SECONDS: Final = 5.0
MOST_KEPT: Final = 30
"""Messages of one key that are kept whole; of earlier ones only the stamp stays."""
MOST_POSES: Final = 5000
"""Poses of one frame that are looked at; a navigator keeps fewer, as it meets images at once."""
HEARD: Final = (
    keys.COLOR, keys.COLOR_RAW, keys.DEPTH, keys.DEPTH_RAW, keys.CAMERA_INFO, keys.TF,
    keys.TF_STATIC, keys.ODOM, keys.CMD_VEL, keys.NAVIGATION_ACTIVE, keys.NAVIGATION_STATUS,
)  # fmt: skip
_ALL_KEPT: Final = (keys.TF, keys.TF_STATIC, keys.ODOM)


@dataclass(slots=True)
class Arrival:
    """One message."""

    at_ns: int
    """When it arrived, by the clock of this machine."""
    stamp_ns: int | None
    """Stamp of its header; None if it is too short for one."""
    payload: bytes


@dataclass(slots=True, kw_only=True)
class Samples:
    """Messages of a robot by key, and who serves it."""

    seconds: float
    arrivals: dict[str, list[Arrival]] = field(default_factory=dict[str, list[Arrival]])
    bridges: tuple[str, ...] = ()
    """Liveliness tokens of `ippon ros2`."""
    navigator: bool = False
    takes_velocities: bool = False
    """Somebody subscribes to `cmd_vel`."""
    takes_goals: bool = False
    is_mount_assumed: bool = False
    """The poses of the camera are computed with the mount of a profile: they do not measure it."""
    simulated: bool = False
    """Somebody serves the ground truth of a simulated robot, which takes commands."""
    onlookers: bool = False
    """Somebody subscribes to events, as console, viewers and recorder do, and no robot."""

    def of(self, *topics: str) -> tuple[str, list[Arrival]]:
        """Return the first of these keys that has messages, and them; the first key without."""
        best = next((key for key in topics if self.arrivals.get(key)), topics[0])
        return best, self.arrivals.get(best, [])

    def add(self, key: str, payload: bytes, at_ns: int) -> None:
        """Keep a message."""
        kept = self.arrivals.setdefault(key, [])
        # A TFMessage begins with a count: its transforms have stamps of their own.
        stamp_ns = None if key in (keys.TF, keys.TF_STATIC) else _stamp_of(payload)
        kept.append(Arrival(at_ns, stamp_ns, payload))
        if key not in _ALL_KEPT and len(kept) > MOST_KEPT:
            kept[-MOST_KEPT - 1].payload = b""


def listen(session: zenoh.Session, robot: str, seconds: float = SECONDS) -> Samples:
    """Return what comes under a robot's prefix within a time.

    Args:
        session: An open session.
        robot: Key prefix.
        seconds: How long to listen.
    """
    samples = Samples(seconds=seconds)
    lock = threading.Lock()

    def keep(key: str, payload: bytes) -> None:
        with lock:
            samples.add(key, payload, time.time_ns())

    for key in HEARD:
        subscribe(
            session,
            f"{robot}/{key}",
            lambda payload, key=key: keep(key, payload),
            kept=key == keys.TF_STATIC,
        )

    def note_origin(sample: zenoh.Sample) -> None:
        attached = sample.attachment
        if attached is not None and attached.to_bytes() == keys.COMPUTED:
            samples.is_mount_assumed = True

    handler: Any = zenoh.handlers.Callback(note_origin, indirect=False)
    session.declare_subscriber(f"{robot}/{keys.TF}", handler)
    # The subscriptions of this session do not count.
    probes = [
        session.declare_publisher(f"{robot}/{key}", allowed_destination=zenoh.Locality.REMOTE)
        for key in (keys.CMD_VEL, keys.NAVIGATION_GOAL, keys.EVENT)
    ]
    truth = session.declare_querier(f"{robot}/{keys.SIM_TRUTH}")
    time.sleep(seconds)
    samples.bridges = _tokens(session, f"{robot}/alive/ros2/*")
    samples.navigator = bool(_tokens(session, f"{robot}/{keys.NAVIGATOR_ALIVE}"))
    samples.takes_velocities, samples.takes_goals, samples.onlookers = map(_is_heard, probes)
    samples.simulated = _is_heard(truth)
    with lock:
        return samples


def _is_heard(probe: zenoh.Publisher | zenoh.Querier) -> bool:
    status: Any = probe.matching_status
    return bool(status.matching)


def _tokens(session: zenoh.Session, key: str) -> tuple[str, ...]:
    replies: Any = session.liveliness().get(key)
    return tuple(sorted(str(reply.ok.key_expr) for reply in replies if reply.ok is not None))


def _stamp_of(payload: bytes) -> int | None:
    if len(payload) < 12:
        return None
    order = "<" if payload[1] & 1 else ">"
    seconds, nanoseconds = struct.unpack_from(f"{order}iI", payload, 4)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)
