"""Whoever hears of a navigator may ask it at once, also the client that the reference shows."""

import re
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import get_args

import pytest

from app.links.network.requests import ask, last_message
from app.links.network.subscription import is_alive, subscribe
from app.messages import keys
from app.messages.control import SearchAccepted, SearchRequest
from app.messages.status import MissionState
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.node import Navigator
from app.nodes.navigator.services import operation_queue
from ippon.mapping.voxel_map import MapConfig
from ippon.mission.config import MissionConfig
from tests.locations import ROOT

REFERENCE = ROOT / "docs" / "reference" / "messages.md"
CONFIG = NavigatorConfig(
    robot="r", mission=MissionConfig(map=MapConfig(voxel_size_m=0.2, memory_limit_mb=64.0))
)


@pytest.mark.parametrize("sign", ["token", "labels"])
def test_a_request_that_follows_the_first_sign_of_life_is_answered(sessions, sign):
    router, client = sessions
    labels = threading.Event()
    subscribe(client, f"r/{keys.LABELS}", lambda _: labels.set())

    def ask_at_once():
        if sign == "token":
            assert is_alive(client, f"r/{keys.NAVIGATOR_ALIVE}", 60.0)
        else:
            assert labels.wait(60.0)
        accepted = ask(client, f"r/{keys.SEARCH}", SearchRequest(object="hat"), SearchAccepted, 60)
        return accepted, last_message(client, f"r/{keys.CONFIGURATION}", 60.0)

    with ThreadPoolExecutor(1) as pool:
        answers = pool.submit(ask_at_once)
        navigator = Navigator(CONFIG, router)
        try:
            accepted, configuration = answers.result(120.0)
        finally:
            navigator.close()
    assert accepted.object == "hat"
    assert configuration is not None


class EnoughError(Exception):
    """The state was printed: the client would go on for ever."""


@pytest.mark.slow
def test_the_client_of_the_reference_asks_and_follows(robot, free_endpoint, monkeypatch):
    # Robot, navigator and client share one interpreter here.
    monkeypatch.setattr(operation_queue, "ANSWER_S", 20.0)
    (code,) = re.findall(r"```python\n(.*?)```", REFERENCE.read_text("utf-8"), re.DOTALL)
    code = code.replace("tcp/127.0.0.1:7447", free_endpoint).replace('"ippon/', '"r/')
    code = code.replace("timeout=10.0", "timeout=30.0")
    told = []

    def show(what):
        told.append(what)
        if isinstance(what, str):
            raise EnoughError

    names = {"print": show}
    try:
        with robot.sending(), pytest.raises(EnoughError):
            exec(code, names)
    finally:
        names["session"].close()
    accepted, state = told
    assert accepted["object"] == "mug"
    assert state in get_args(MissionState)
    status = robot.send_until(lambda s: s.queue or s.goal.object == "mug")
    asked = status.queue[0] if status.queue else status.goal
    assert (asked.display, asked.context) == ("red mug", "I think it is in the kitchen")
