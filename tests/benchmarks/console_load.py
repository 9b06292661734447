"""The console under load: eight watchers, a tab that sleeps, and what is left after an hour."""

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from websockets.exceptions import ConnectionClosed

from tests.app.nodes.console.published_home import PublishedHome
from tests.app.nodes.console.served import ConsoleProcess, SceneWatcher
from tests.benchmarks.rows import Row
from tests.ports import free_port

_WAKE_S = 3.0
_PAGE = os.sysconf("SC_PAGE_SIZE")
_HZ = os.sysconf("SC_CLK_TCK")


def load_rows(seconds_of_robot: int) -> Iterator[Row]:
    """Measure a console on a drawn home, as fast as it takes the messages.

    Args:
        seconds_of_robot: How much of the robot's time to send, at five frames a second.
    """
    zenoh_port = free_port()
    home = PublishedHome(zenoh_port)
    console = ConsoleProcess(zenoh_port, free_port(), as_users=True)
    try:
        console.wait_until_up()
        yield from _watched(home, console, watchers=1)
        yield from _watched(home, console, watchers=8)
        yield from _slept(home, console, min(600, seconds_of_robot // 2))
        yield from _endured(home, console, seconds_of_robot)
    finally:
        console.close()
        home.close()


def _watched(home: Any, console: Any, watchers: int, seconds: float = 10.0) -> Iterator[Row]:
    scenes = [SceneWatcher(console.url) for _ in range(watchers)]
    try:
        _read(scenes, 4.0)
        before_s, sent = _cpu_s(console), [scene.bytes for scene in scenes]
        _read(scenes, seconds)
        used_s = _cpu_s(console) - before_s
        read = sum(scene.bytes for scene in scenes) - sum(sent)
    finally:
        for scene in scenes:
            scene.close()
    data = f"{watchers} watchers, 5 Hz"
    yield Row(name="console.core_percent", data=data, value=100.0 * used_s / seconds, unit="%")
    yield Row(name="console.memory", data=data, value=_rss_mb(console), unit="MB")
    each = read / watchers / seconds / 1e3
    yield Row(name="console.traffic_each", data=data, value=each, unit="kB/s")


def _slept(home: Any, console: Any, seconds: int) -> Iterator[Row]:
    """Minutes of messages for a tab that does not read, then all that it gets.

    Where the console has hung up on it meanwhile, that is what it gets when it comes back.
    """
    data = f"{seconds / 60:.0f} min"
    scene = SceneWatcher(console.url)
    try:
        scene.read(1.0, 10.0)
        first = scene.bytes
        before_mb = _rss_mb(console)
        _send(home, seconds)
        kept_mb = _rss_mb(console) - before_mb
        yield Row(name="console.memory_for_sleeper", data=data, value=kept_mb, unit="MB")
        try:
            scene.read(_WAKE_S, _WAKE_S)
        except ConnectionClosed:
            scene = SceneWatcher(console.url)
            scene.read(_WAKE_S, _WAKE_S)
            first = 0
        woken_mb = (scene.bytes - first) / 1e6
        yield Row(name="console.first_seconds_awake", data=data, value=woken_mb, unit="MB")
    finally:
        scene.close()


def _endured(home: Any, console: Any, seconds: int) -> Iterator[Row]:
    _send(home, seconds // 10)
    before_mb = _rss_mb(console)
    _send(home, seconds)
    data = f"{seconds / 60:.0f} min"
    yield Row(name="console.memory_before", data=data, value=before_mb, unit="MB")
    yield Row(name="console.memory_after", data=data, value=_rss_mb(console), unit="MB")


def _send(home: Any, seconds: int) -> None:
    """Send so much of the robot's time, each tick as soon as the one before is on its way."""
    for _ in range(seconds * 5):
        home.tick()


def _read(scenes: list[Any], seconds: float) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        for scene in scenes:
            scene.read(0.005, 0.05)


def _cpu_s(console: Any) -> float:
    fields = Path(f"/proc/{console.process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _HZ


def _rss_mb(console: Any) -> float:
    return int(Path(f"/proc/{console.process.pid}/statm").read_text().split()[1]) * _PAGE / 1e6
