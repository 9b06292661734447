"""Real zenoh sessions over loopback, and whole processes."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import pytest
import zenoh

from app.links.network import session
from app.links.network.session import open_client, open_router
from ippon.simulation.scene import Scene
from ippon.simulation.scene_writer import save_scene
from tests.app.process_template import COMMANDS, Copy
from tests.boxes import boxes_scene
from tests.evaluation_rows import make_row
from tests.locations import ROOT
from tests.ports import free_endpoint

PATIENT_LEASE_MS = 30_000


@pytest.fixture(name="free_endpoint")
def free_endpoint_fixture() -> str:
    """Return a loopback endpoint that nobody listens on."""
    return free_endpoint()


@pytest.fixture(scope="module")
def shared_endpoint() -> str:
    """Return a loopback endpoint for what `launch_shared` starts."""
    return free_endpoint()


@pytest.fixture
def patient_links(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a link be silent for longer than usual.

    On a machine with ten times more to do than it has cores, a connection is silent for over a
    second now and then: it would be closed, and what is sent meanwhile be lost.
    """
    monkeypatch.setattr(session, "LEASE_MS", PATIENT_LEASE_MS)


@pytest.fixture
def sessions(
    free_endpoint: str, patient_links: None
) -> Iterator[tuple[zenoh.Session, zenoh.Session]]:
    """Yield a router on a free loopback port, and a client of it."""
    router = open_router(free_endpoint)
    client = open_client(free_endpoint)
    yield router, client
    client.close()
    router.close()


class Process:
    """One process of the product, with its log."""

    def __init__(self, arguments: Sequence[str], log: Path, environment: Mapping[str, str]) -> None:
        self._log = log
        environment = {**os.environ, "PYTHONFAULTHANDLER": "1", **environment}
        with log.open("wb") as stream:
            if arguments[0] in COMMANDS:
                self.child = Copy(arguments, subprocess.PIPE, stream.fileno(), environment)
                return
            self.child = subprocess.Popen(
                [sys.executable, "-m", "app", *arguments],
                cwd=ROOT,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=stream,
                start_new_session=True,
                text=True,
            )

    def log(self) -> str:
        """Return what it wrote to standard error so far."""
        return self._log.read_text(errors="replace")

    def wait_for_log(self, text: str, timeout_s: float = 60.0) -> None:
        """Wait until the log holds a text."""
        deadline = time.monotonic() + timeout_s
        while text not in self.log():
            assert self.child.poll() is None, f"it ended with {self.child.poll()}:\n{self.log()}"
            assert time.monotonic() < deadline, f"no {text!r} in:\n{self.log()}"
            time.sleep(0.02)

    def finish(self, timeout_s: float = 60.0) -> tuple[int, str]:
        """Wait for the end; return exit status and standard output."""
        try:
            out, _ = self.child.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            # Each of its threads writes into its log where it is.
            self.child.send_signal(signal.SIGABRT)
            self.child.wait(10.0)
            raise AssertionError(f"it did not end in {timeout_s:g} s:\n{self.log()}") from None
        return self.child.returncode, out


def own_folders(folder: Path) -> dict[str, str]:
    """Return the environment that keeps the user's files, and the running navigators, apart."""
    names = ("XDG_RUNTIME_DIR", "XDG_CACHE_HOME", "XDG_DATA_HOME")
    return dict.fromkeys(names, str(folder))


@pytest.fixture
def runtime(tmp_path: Path) -> dict[str, str]:
    """Environment that keeps the list of running navigators to this test."""
    return own_folders(tmp_path)


@contextlib.contextmanager
def _launching(folder: Path, environment: Mapping[str, str]) -> Iterator[Callable[..., Process]]:
    started: list[Process] = []

    def start(*arguments: str) -> Process:
        log = folder / f"{len(started)}-{arguments[0]}.log"
        started.append(Process(arguments, log, environment))
        return started[-1]

    yield start
    for process in started:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.child.pid, signal.SIGKILL)
        process.child.communicate()


@pytest.fixture
def launch(tmp_path: Path, runtime: dict[str, str]) -> Iterator[Callable[..., Process]]:
    """Start `ippon ...`; whatever still runs at the end of the test is killed."""
    with _launching(tmp_path, runtime) as start:
        yield start


@pytest.fixture(scope="module")
def launch_shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Process]]:
    """Start `ippon ...` for all tests of a module."""
    folder = tmp_path_factory.mktemp("shared")
    with _launching(folder, own_folders(folder)) as start:
        yield start


_BOXES = (
    ("floor", "floor", (-0.1, -0.1, -0.1), (6.1, 5.1, 0.0)),
    ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, 5.1, 2.5)),
    ("wall", "wall", (6.0, -0.1, 0.0), (6.1, 5.1, 2.5)),
    ("wall", "wall", (0.0, -0.1, 0.0), (6.0, 0.0, 2.5)),
    ("wall", "wall", (0.0, 5.0, 0.0), (6.0, 5.1, 2.5)),
    ("table", "dining table", (4.6, 1.0, 0.0), (5.6, 2.0, 0.7)),
    ("clothes", "hat", (5.0, 1.4, 0.7), (5.3, 1.7, 0.85)),
    ("chair", "armchair", (0.8, 4.1, 0.0), (1.5, 4.8, 0.9)),
)
_STARTS = ((0.8, 0.8), (1.6, 2.4), (2.6, 0.7), (3.2, 4.2))


def room_scene() -> Scene:
    """Return a home of one room: an armchair in one corner, a hat on a table in another."""
    return boxes_scene(_BOXES, _STARTS, name="room")


@pytest.fixture
def room(tmp_path):
    """A folder with the home of one room."""
    folder = tmp_path / "room"
    save_scene(room_scene(), folder)
    return folder


@pytest.fixture(name="make_row")
def make_row_fixture():
    """Rows with figures that a test chooses; everything else is plain."""
    return make_row
