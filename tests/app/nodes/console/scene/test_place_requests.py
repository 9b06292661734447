import time

import pytest

from app.messages.memory import MemoryReply
from app.nodes.console.link.commands import CommandError
from app.nodes.console.scene import place_requests
from app.nodes.console.scene.place_requests import PlaceRequests
from app.view.model.scene_model import SceneModel
from tests.app.nodes.console.drawn_home import rooms_of, things_of


class _Link:
    def __init__(self):
        self.asked = 0
        self.problem = None

    def rooms(self):
        self.asked += 1
        if self.problem is not None:
            raise self.problem
        return rooms_of()

    def things(self):
        return MemoryReply(things=things_of(), count=5)


@pytest.fixture
def link():
    return _Link()


@pytest.fixture
def requests(link, monkeypatch):
    # However slow the machine is, it is not time for the next question.
    monkeypatch.setattr(place_requests, "EVERY_S", 1e6)
    requests = PlaceRequests(link)
    yield requests
    requests.close()


def _until(test):
    deadline = time.monotonic() + 10.0
    while not test():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_while_somebody_looks_rooms_and_things_are_known(requests, link):
    model = SceneModel()

    def known():
        requests.step(model, time.monotonic())
        return bool(model.rooms)

    _until(known)
    assert len(model.things) == 5
    for _ in range(20):
        requests.step(model, time.monotonic())
    assert link.asked == 1, "once in EVERY_S"
    requests.step(model, time.monotonic(), again=True)

    def is_asked_again():
        # The first request may not be over yet, though its answer has come.
        requests.step(model, time.monotonic())
        return link.asked == 2

    _until(is_asked_again)


def test_nobody_is_asked_while_nobody_looks(requests, link):
    for _ in range(5):
        requests.step(SceneModel(), -1e9)
    time.sleep(0.05)
    assert link.asked == 0


def test_a_navigator_that_does_not_answer_is_asked_again(requests, link):
    link.problem = CommandError("no navigator")
    model = SceneModel()
    requests.step(model, time.monotonic())
    _until(lambda: link.asked == 1)
    link.problem = None

    def known():
        requests.step(model, time.monotonic(), again=True)
        return bool(model.rooms)

    _until(known)
