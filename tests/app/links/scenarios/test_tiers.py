"""A campus's router before a building's: what crosses the link between them."""

import datetime as dt
import json
import os
import time

import pytest
import zenoh

from app.certificates.roles import write_roles
from app.links.network.requests import ask, serve
from app.links.network.session import PROFILE, open_client, open_router
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.control import ControlReply, ControlRequest
from tests.app.relay import Relay
from tests.ports import free_port

IMAGE = "ippon/camera/color/image_raw/compressed"
SIZE = 2000
"""Larger messages pass by shared memory between processes of one machine."""
IMAGES = 20


class Campus:
    """A building with a robot, and a campus whose link to the building is counted."""

    def __init__(self, folder, become):
        building_port, campus_port = free_port(), free_port()
        write_roles(
            folder,
            robots=("ippon",),
            hosts=("localhost", "127.0.0.1"),
            days=2,
            now=dt.datetime.now(dt.UTC),
        )
        near, self.far = f"tls/127.0.0.1:{building_port}", f"tcp/127.0.0.1:{campus_port}"
        self._sessions = []
        become(folder / "navigator.json5")
        self.building = self._kept(open_router(near))
        become(folder / "robot.json5")
        self.robot = self._kept(open_client(near))
        become("")
        self.link = Relay(building_port)
        config = zenoh.Config.from_file(str(folder / "console.json5"))
        for name, value in {
            "mode": "router",
            "listen/endpoints": [self.far],
            "connect/endpoints": [f"tls/127.0.0.1:{self.link.port}"],
            "transport/link/protocols": ["tls", "tcp"],
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
        }.items():
            config.insert_json5(name, json.dumps(value))
        self._kept(zenoh.open(config))

    def _kept(self, session):
        self._sessions.append(session)
        return session

    def join(self):
        """Return a session at the campus's router."""
        return self._kept(open_client(self.far))

    def passed_by_image(self, *watched):
        """Return the bytes that cross the link for each image that comes to all who watch.

        A link that is held up loses images, and those that are under way come before the last.
        """
        before, seen = self.link.passed, [len(images) for images in watched]

        def came():
            return min(
                sum(len(image) == SIZE for image in images[count:])
                for images, count in zip(watched, seen, strict=True)
            )

        wait_until(lambda: self.robot.put(IMAGE, os.urandom(SIZE)) or came() >= IMAGES)
        wait_until(
            lambda: (
                self.robot.put(IMAGE, b"last") or {images[-1] for images in watched} == {b"last"}
            )
        )
        return (self.link.passed - before) / came()

    def close(self):
        """End everything."""
        for session in reversed(self._sessions):
            session.close()
        self.link.close()


@pytest.fixture
def campus(tmp_path, patient_links, monkeypatch):
    campus = Campus(tmp_path, lambda profile: monkeypatch.setenv(PROFILE, str(profile)))
    yield campus
    campus.close()


def wait_until(reached):
    deadline = time.monotonic() + 10.0
    while not reached():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_images_cross_the_link_for_who_watches_once(campus):
    in_building, watched, watched_too = [], [], []
    subscribe(campus.building, "ippon/camera/**", in_building.append)
    wait_until(lambda: campus.robot.put(IMAGE, b"one") or in_building)
    assert campus.passed_by_image(in_building) < SIZE / IMAGES
    subscribe(campus.join(), "ippon/camera/**", watched.append)
    wait_until(lambda: campus.robot.put(IMAGE, b"one") or watched)
    assert SIZE <= campus.passed_by_image(in_building, watched) < 1.5 * SIZE
    subscribe(campus.join(), "ippon/camera/**", watched_too.append)
    wait_until(lambda: campus.robot.put(IMAGE, b"one") or watched_too)
    assert campus.passed_by_image(in_building, watched, watched_too) < 1.5 * SIZE


def test_requests_pass_and_commands_to_the_base_do_not(campus):
    heard, status = [], []
    stopped = ControlReply(state="stopped")
    served = serve(campus.building, f"ippon/{keys.CONTROL}", ControlRequest, lambda _: stopped)
    subscribe(campus.building, "ippon/**", heard.append)
    far = campus.join()
    subscribe(far, "ippon/status", status.append)
    wait_until(lambda: campus.building.put("ippon/status", b"fine") or status)
    for _ in range(10):
        far.put("ippon/cmd_vel", b"go")
        far.put(IMAGE, b"a false picture")
        time.sleep(0.02)
    request = ControlRequest(action="stop")
    assert ask(far, "ippon/control", request, ControlReply, 3.0) == stopped
    wait_until(lambda: far.put("ippon/teleop/cmd_vel", b"by hand") or b"by hand" in heard)
    assert not {b"go", b"a false picture"} & set(heard)
    del served
