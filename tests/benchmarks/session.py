"""What one search of the demo costs: its processes, its messages, and its recording.

The demo searches in real time, with one page that watches. Its recording is then repeated through
the writer until it is an hour long, opened as `ippon review` does, and sought in.
"""

import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import zenoh

from app.links.network.session import open_client
from app.messages import keys
from app.nodes.review.player import Player
from app.recording.channels import MARKERS_KEY
from app.recording.reading.recording import Recording
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from tests.app.nodes.console.served import SceneWatcher
from tests.benchmarks.fleet import cpu_s, rss_mb
from tests.benchmarks.rows import Row
from tests.locations import ROOT
from tests.ports import free_port

HOME: Final = "floor:0"
"""Large enough that the search goes on as long as it is measured."""
OBJECT: Final = "umbrella"
PROCESSES: Final = ("navigate", "console", "sim", "record")
READY_S: Final = 300.0
JUMPS: Final = 200
ROBOT_KEYS: Final = frozenset(
    (keys.COLOR, keys.DEPTH, keys.CAMERA_INFO, keys.TF, keys.TF_STATIC, keys.CONTACT)
)
GROUPS: Final = {
    keys.MAP_VOXELS: "changes of the map",
    keys.MAP_KEYFRAME: "whole maps",
    keys.LEVELS: "levels",
    keys.STATUS: "status",
    keys.HEATMAP: "heatmaps of the robot",
    **dict.fromkeys(ROBOT_KEYS, "images and poses of the robot"),
}


def session_rows(seconds: float, hour_s: float) -> Iterator[Row]:
    """Measure a search for some seconds, then a recording of some seconds made of it."""
    with tempfile.TemporaryDirectory() as folder:
        yield from _search_rows(Path(folder) / "sessions", seconds)
        (file,) = (Path(folder) / "sessions").rglob("*.mcap")
        yield from _hour_rows(file, Path(folder) / "hour", hour_s)


def _search_rows(sessions: Path, seconds: float) -> Iterator[Row]:
    port = free_port()
    command = [sys.executable, "-m", "app", "demo", "--home", HOME, "--object", OBJECT]
    command += ["--port", str(port), "--record-to", str(sessions)]
    log = tempfile.TemporaryFile("w+")  # noqa: SIM115
    demo = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT)
    try:
        _wait_for("simulated robot in ", log, demo)
        pids = _children(demo.pid)
        sent, count = Counter[str](), Counter[str]()
        page = _Page(f"http://127.0.0.1:{port}")
        session = _count(_command_line(pids["navigate"]), sent, count)
        # The first turn of the robot, and the page's first scene.
        time.sleep(10.0)
        sent.clear()
        count.clear()
        before = {name: cpu_s(pid) for name, pid in pids.items()}
        since = time.monotonic()
        time.sleep(seconds)
        took = time.monotonic() - since
        used = {name: cpu_s(pid) - before[name] for name, pid in pids.items()}
        data = f"demo, {HOME}, {took:.0f} s of a search, one page"
        for name, pid in pids.items():
            yield Row(name=f"{name}, of a core", data=data, value=100 * used[name] / took, unit="%")
            yield Row(name=f"{name}, memory", data=data, value=rss_mb(pid), unit="MB")
        rate = count[keys.COLOR] / took
        yield Row(name="images; 5 unless the machine is too busy", data=data, value=rate, unit="Hz")
        groups = Counter[str]()
        for key, size in sent.items():
            groups[GROUPS.get(key, "all else")] += size
        for name, size in groups.items():
            yield Row(name=f"messages: {name}", data=data, value=size / took / 1e3, unit="kB/s")
        page.close()
        session.close()  # pyright: ignore[reportUnknownMemberType]
    finally:
        demo.send_signal(signal.SIGINT)
        try:
            demo.wait(60.0)
        except subprocess.TimeoutExpired:
            demo.kill()
        log.close()


class _Page:
    """A page that watches, without a browser."""

    def __init__(self, url: str) -> None:
        self._scene: Any = SceneWatcher(url)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        while not self._closing.is_set():
            self._scene.read(quiet_s=0.2, timeout_s=1.0)

    def close(self) -> None:
        self._closing.set()
        self._thread.join(10.0)
        self._scene.close()


def _count(navigator: str, sent: Counter[str], count: Counter[str]) -> zenoh.Session:
    """Count bytes and messages of each key of the robot that a navigator's command line names."""
    ((endpoint, robot),) = re.findall(r"--listen (\S+) .*--robot (\S+)", navigator)
    session = open_client(endpoint, 20.0)

    def take(sample: zenoh.Sample) -> None:
        key = str(sample.key_expr).removeprefix(f"{robot}/")
        sent[key] += len(sample.payload)
        count[key] += 1

    handler = zenoh.handlers.Callback(take, indirect=False)
    session.declare_subscriber(f"{robot}/**", handler)
    return session


def _wait_for(text: str, log: Any, demo: "subprocess.Popen[bytes]") -> None:
    deadline = time.monotonic() + READY_S
    while True:
        log.seek(0)
        said = log.read()
        if text in said:
            return
        if demo.poll() is not None or time.monotonic() > deadline:
            raise RuntimeError(f"the demo did not start:\n{said}")
        time.sleep(0.2)


def _children(parent: int) -> dict[str, int]:
    found: dict[str, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and _parent(entry) == parent:
            line = _command_line(int(entry.name))
            found |= {name: int(entry.name) for name in PROCESSES if f" {name} " in line}
    return found


def _parent(entry: Path) -> int:
    try:
        return int((entry / "stat").read_text().rpartition(")")[2].split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return -1


def _command_line(pid: int) -> str:
    return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")


def _hour_rows(file: Path, root: Path, seconds: float) -> Iterator[Row]:
    source = Recording(file)
    # The writer makes the markers itself.
    messages = [one for one in source.all_messages() if one.key != MARKERS_KEY]
    start_ns, span_ns = source.start_ns, max(1, source.end_ns - source.start_ns)
    source.close()
    session = Session(root, "ippon", RecordingLimits(), start_ns)
    began, count, late_ns = time.process_time(), 0, 0
    while late_ns < seconds * 1e9:
        for message in messages:
            at_ns = message.time_ns + late_ns
            session.add(message.key, message.payload, at_ns, (at_ns - start_ns) * 1e-9)
        count += len(messages)
        late_ns += span_ns
    session.close()
    used_s = time.process_time() - began
    data = f"recording of {seconds / 60:.0f} min"
    note = f"{late_ns * 1e-9 / 3600:.2f} hours, {count:,} messages"
    written = session.writer.folder
    size = sum(one.stat().st_size for one in written.glob("*.mcap"))
    per_hour = 3600e9 / late_ns
    share = 100e9 * used_s / late_ns
    yield Row(name="writing, of a core", data=data, value=share, unit="%", note=note)
    yield Row(name="size of an hour", data=data, value=size * per_hour / 1e9, unit="GB", note=note)
    began = time.perf_counter()
    recording = Recording(written)
    player = Player(recording, lambda *_: None)
    opened_s = time.perf_counter() - began
    yield Row(name="opened for review", data=data, median_ms=1e3 * opened_s, note=note)
    rng, times = random.Random(0), list[float]()
    for _ in range(JUMPS):
        moment = rng.uniform(0.0, recording.duration_s)
        began = time.perf_counter()
        player.seek(moment)
        times.append(1e3 * (time.perf_counter() - began))
    recording.close()
    for name, q in (("median", 50), ("95 of 100 below", 95)):
        title = f"jump to a moment, its messages, {name}"
        yield Row(name=title, data=data, median_ms=float(np.percentile(times, q)), note=note)
