"""A navigator that searches for a hat, in a thread, and the robot that it hears."""

import threading

import pytest

from app.messages import keys
from app.messages.control import SearchRequest, encode
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.node import Navigator
from tests.app.nodes.navigator.scenarios.standing_robot import Robot


@pytest.fixture
def world():
    """Where the robot stands; None for a generated home."""
    return


@pytest.fixture
def config():
    """How the navigator is started."""
    return NavigatorConfig(robot="r", heatmap_lost_s=0.5)


@pytest.fixture
def robot(sessions, world, config):
    router, client = sessions
    robot = Robot(client, world)
    navigator, stop = Navigator(config, router), threading.Event()
    thread = threading.Thread(target=navigator.run, args=(stop,))
    thread.start()
    list(client.get(f"r/{keys.SEARCH}", payload=encode(SearchRequest(object="hat")), timeout=10.0))
    robot.send_until(lambda s: s.frames > 3 and s.state != "lost", 120.0)
    robot.navigator = navigator
    yield robot
    stop.set()
    thread.join()
    navigator.close()
