"""Many light robots on one router: traffic, delays, and what the router costs.

A robot sends recorded images (JPEG, depth as PNG without loss), intrinsics and tf, and hears its
commands. For each robot a client receives all of it, as a navigator does, and sends commands, and
another one receives colour alone, as a page with its camera does.
"""

import multiprocessing
import os
import threading
import time
from collections.abc import Iterator
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

import numpy as np
import zenoh

from app.links.network.session import open_client, open_router
from app.messages import keys
from app.messages.depth.depth_images import encode_depth, encode_depth_raw
from app.messages.images import encode_camera, encode_color
from app.messages.motion import StampedTransform, StampedTwist, encode_transforms, encode_twist
from app.ros2.ippon_ros2.depth_png import compress_depth
from ippon.frame import Frame
from tests.benchmarks.frames import home_frames, kitchen_frames
from tests.benchmarks.rows import Row
from tests.ports import free_port

IMAGE_HZ, TF_HZ, COMMAND_HZ = 5.0, 25.0, 30.0
_HZ = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")

Payloads = list[dict[str, bytes]]


def fleet_rows(robots: int, images: str = "kitchen", seconds: float = 15.0) -> Iterator[Row]:
    """Measure a router with so many robots.

    Args:
        robots: How many.
        images: "kitchen" for recorded ones; "home" for rendered ones with a noisy depth, which
            compresses less.
        seconds: How long.
    """
    frames = kitchen_frames(20) if images == "kitchen" else home_frames(20)
    payloads = _payloads(frames)
    size = sum(len(one) for frame in payloads for one in frame.values()) / len(payloads)
    context = multiprocessing.get_context("spawn")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    stop, results = context.Event(), context.Queue()
    router = context.Process(target=_route, args=(endpoint, stop))
    router.start()
    ends = [
        context.Process(target=run, args=(endpoint, robots, payloads, seconds, results))
        for run in (_receive, _send)
    ]
    for end in ends:
        end.start()
    try:
        time.sleep(4.0 + 0.3 * seconds)
        before_s, since = cpu_s(router.pid), time.monotonic()
        time.sleep(0.5 * seconds)
        share = 100.0 * (cpu_s(router.pid) - before_s) / (time.monotonic() - since)
        memory_mb = rss_mb(router.pid)
        measured: dict[str, Any] = {}
        for _ in ends:
            measured |= results.get(timeout=seconds + 60.0)
    finally:
        stop.set()
        for process in (*ends, router):
            process.join(20.0)
    data = f"{robots} robots, {images}"
    tf = TF_HZ * len(_tf(0))
    yield Row(name="fleet.traffic_each", data=data, value=(IMAGE_HZ * size + tf) / 1e6, unit="MB/s")
    yield Row(name="fleet.router_core", data=data, value=share, unit="%")
    yield Row(name="fleet.router_memory", data=data, value=memory_mb, unit="MB")
    for what, unit in (("images", "Hz"), ("views", "Hz"), ("commands", "Hz")):
        rates = measured[what]["rates"]
        yield Row(name=f"fleet.{what}_least", data=data, value=min(rates), unit=unit)
        ages_ms = 1e3 * np.array(measured[what]["ages"])
        for name, q in (("p50", 50), ("p99", 99)):
            value = float(np.percentile(ages_ms, q))
            yield Row(name=f"fleet.{what}_{name}", data=data, value=value, unit="ms")


def depth_rows(images: str) -> Iterator[Row]:
    """Measure depth that a ROS 2 bridge packs, `compress: true`."""
    frames = kitchen_frames(20) if images == "kitchen" else home_frames(20)
    sizes: list[int] = []
    times: list[float] = []
    for frame in frames:
        raw = encode_depth_raw(np.nan_to_num(frame.depth), frame.stamp_ns, "eye")
        began = time.process_time()
        packed = compress_depth(raw)
        times.append(1e3 * (time.process_time() - began))
        assert packed is not None, "depth in millimetres is packed"
        sizes.append(len(packed))
    data = f"{images}, 640 x 480"
    yield Row(name="fleet.packed_depth", data=data, value=float(np.median(sizes)) / 1e3, unit="kB")
    yield Row(name="fleet.packing_depth", data=data, median_ms=float(np.median(times)))


def _payloads(frames: list[Frame]) -> Payloads:
    return [
        {
            keys.CAMERA_INFO: encode_camera(frame.camera, frame.stamp_ns, "eye"),
            keys.DEPTH: encode_depth(frame.depth, frame.stamp_ns, "eye"),
            keys.COLOR: encode_color(frame.color, frame.stamp_ns, "eye"),
        }
        for frame in frames
    ]


def _tf(stamp_ns: int) -> bytes:
    pose = StampedTransform(
        stamp_ns=stamp_ns, parent="map", child="base_link", T_parent_child=np.eye(4)
    )
    return encode_transforms([pose, pose])


def _route(endpoint: str, stop: Event) -> None:
    session = open_router(endpoint)
    stop.wait()
    session.close()  # pyright: ignore[reportUnknownMemberType]


class _Ages:
    """Ages of messages by the stamp in their attachment, after a start."""

    def __init__(self, robots: int, since: float) -> None:
        self._lock, self._since = threading.Lock(), since
        self._arrivals: list[list[float]] = [[] for _ in range(robots)]
        self._ages: list[float] = []

    def take(self, robot: int, sample: zenoh.Sample) -> None:
        now, at = time.time(), time.monotonic()
        if at < self._since or sample.attachment is None:
            return
        sent = int.from_bytes(sample.attachment.to_bytes(), "little") / 1e9
        with self._lock:
            self._arrivals[robot].append(at)
            self._ages.append(now - sent)

    def as_result(self, name: str) -> dict[str, Any]:
        rates = [(len(a) - 1) / (a[-1] - a[0]) if len(a) > 1 else 0.0 for a in self._arrivals]
        return {name: {"rates": rates, "ages": self._ages}}


def _hear(session: zenoh.Session, key: str, take: Any) -> None:
    session.declare_subscriber(key, zenoh.handlers.Callback(take, indirect=False))


def _stamp() -> bytes:
    return time.time_ns().to_bytes(8, "little")


def _publisher(session: zenoh.Session, key: str, *, urgent: bool = False) -> zenoh.Publisher:
    return session.declare_publisher(
        key,
        congestion_control=zenoh.CongestionControl.DROP,
        priority=zenoh.Priority.REAL_TIME if urgent else zenoh.Priority.DATA,
        express=urgent,
    )


def _send(endpoint: str, robots: int, payloads: Payloads, seconds: float, results: Any) -> None:
    """Be the robots: one session each, in one process, spread over the period of the camera."""
    commands = _Ages(robots, time.monotonic() + 4.0)
    sessions = [open_client(endpoint, 20.0) for _ in range(robots)]
    topics = (*payloads[0], keys.TF)
    put = []
    for k, session in enumerate(sessions):
        put.append({topic: _publisher(session, f"r{k}/{topic}").put for topic in topics})
        _hear(session, f"r{k}/{keys.CMD_VEL}", lambda sample, k=k: commands.take(k, sample))
    steps, images = round(seconds * TF_HZ) + 100, round(TF_HZ / IMAGE_HZ)
    due = time.monotonic()
    for step in range(steps):
        for k in range(robots):
            put[k][keys.TF](_tf(time.time_ns()), attachment=_stamp())
            if (step + k) % images == 0:
                frame = payloads[(step // images + k) % len(payloads)]
                for topic, payload in frame.items():
                    put[k][topic](payload, attachment=_stamp())
        due += 1.0 / TF_HZ
        time.sleep(max(0.0, due - time.monotonic()))
    results.put(commands.as_result("commands"))
    for session in sessions:
        session.close()  # pyright: ignore[reportUnknownMemberType]


def _receive(endpoint: str, robots: int, _: Payloads, seconds: float, results: Any) -> None:
    """Be what listens to the robots, and command them."""
    since = time.monotonic() + 4.0
    images, views = _Ages(robots, since), _Ages(robots, since)
    sessions = [open_client(endpoint, 20.0) for _ in range(robots)]
    pages = [open_client(endpoint, 20.0) for _ in range(robots)]
    put = []
    for k, session in enumerate(sessions):
        for topic in (keys.CAMERA_INFO, keys.DEPTH, keys.TF):
            _hear(session, f"r{k}/{topic}", lambda _: None)
        _hear(session, f"r{k}/{keys.COLOR}", lambda sample, k=k: images.take(k, sample))
        _hear(pages[k], f"r{k}/{keys.COLOR}", lambda sample, k=k: views.take(k, sample))
        put.append(_publisher(session, f"r{k}/{keys.CMD_VEL}", urgent=True).put)
    twist = encode_twist(StampedTwist(stamp_ns=1, linear_m_s=0.1, yaw_rate_rad_s=0.0))
    due = time.monotonic()
    while time.monotonic() < since + seconds:
        for one in put:
            one(twist, attachment=_stamp())
        due += 1.0 / COMMAND_HZ
        time.sleep(max(0.0, due - time.monotonic()))
    results.put(images.as_result("images") | views.as_result("views"))
    for session in (*sessions, *pages):
        session.close()  # pyright: ignore[reportUnknownMemberType]


def cpu_s(pid: int | None) -> float:
    """Return the processor time that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _HZ


def rss_mb(pid: int | None) -> float:
    """Return the memory of a process."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * _PAGE / 1e6
