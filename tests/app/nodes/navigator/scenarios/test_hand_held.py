"""The navigator's process with a camera in a hand: it says where to go, and commands nothing."""

import threading

import pytest

from app.links.network.requests import ask
from app.links.network.session import open_client
from app.links.network.subscription import is_alive, subscribe
from app.messages import keys
from app.messages.control import SearchAccepted, SearchRequest, decode
from app.messages.status import Status

pytestmark = pytest.mark.process


def test_a_person_with_a_camera_is_led_and_no_velocity_is_sent(launch, free_endpoint, room):
    navigator = launch(
        "navigate", "--listen", free_endpoint, "--profile", "hand-held", "--voxel-size-m", "0.2"
    )
    navigator.wait_for_log("navigator ready", 240.0)
    session = open_client(free_endpoint)
    led, statuses, velocities = threading.Event(), [], []

    def hear(payload):
        statuses.append(decode(payload, Status))
        if statuses[-1].walk is not None and statuses[-1].walk.way_m > 0.3:
            led.set()

    subscribe(session, f"ippon/{keys.STATUS}", hear)
    subscribe(session, f"ippon/{keys.CMD_VEL}", velocities.append)
    assert is_alive(session, f"ippon/{keys.NAVIGATOR_ALIVE}", 20.0)
    launch(
        "sim", "--connect", free_endpoint, "--home", str(room), "--profile", "hand-held",
        "--width", "96", "--speed", "2",
    )  # fmt: skip
    try:
        ask(session, f"ippon/{keys.SEARCH}", SearchRequest(object="hat"), SearchAccepted, 20.0)
        assert led.wait(60.0), (statuses[-1:], navigator.log())
        assert velocities == []
    finally:
        session.close()
