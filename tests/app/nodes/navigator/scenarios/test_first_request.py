"""Whoever hears of a navigator may ask it at once."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from app.links.network.requests import ask, last_message
from app.links.network.subscription import is_alive, subscribe
from app.messages import keys
from app.messages.control import SearchAccepted, SearchRequest
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.node import Navigator
from ippon.mapping.voxel_map import MapConfig
from ippon.mission.config import MissionConfig

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
