"""A published robot, and a viewer that shows it in a thread."""

import threading
import time
from contextlib import contextmanager

import pytest

from app.nodes.viewers.live_robot import LiveRobot
from tests.app.nodes.console.published_home import PublishedHome
from tests.ports import free_port


@pytest.fixture
def port():
    """A port that nobody listens on."""
    return free_port()


@pytest.fixture
def start_home(port):
    """Starts robots with their navigators; all are closed at the end."""
    homes = []

    def start(**options):
        homes.append(PublishedHome(port, hz=10.0, **options))
        return homes[-1]

    yield start
    for home in homes:
        home.close()


@contextmanager
def shown(viewer, port):
    """Run a viewer in a thread; what it raises, the test raises."""
    robot, stop, errors = LiveRobot(f"tcp/127.0.0.1:{port}", "ippon"), threading.Event(), []

    def run():
        try:
            robot.run(viewer, stop)
        except Exception as error:  # noqa: BLE001 - the test raises it
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield robot
    finally:
        stop.set()
        thread.join(15.0)
    assert not thread.is_alive()
    assert errors == []


@pytest.fixture
def show(port, patient_links):
    """Shows the robot of `port` in a viewer, as a context."""
    return lambda viewer, at=None: shown(viewer, at or port)


@pytest.fixture
def wait():
    """Waits for a condition."""

    def wait(condition, timeout_s=20.0):
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline
            time.sleep(0.02)

    return wait
