"""A find, a real endpoint on loopback, and what it does to the find."""

import base64
import json
import time
from types import SimpleNamespace

import numpy as np
import pytest
import simplejpeg

from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.services.opinion_service import OpinionService
from ippon.mission.finds.second_opinion import SecondOpinionConfig, SecondOpinions
from ippon.mission.snapshot import Find

FIND = Find(
    position_world=(1.0, 0.0, 0.8), size_m=(0.1, 0.1, 0.1), probability=0.9, voxels=4,
    box_px=(40, 30, 60, 50),
)  # fmt: skip


class Asking:
    """The mission's side, without a robot."""

    def __init__(self, model):
        self.opinions = SecondOpinions(SecondOpinionConfig())
        self.queue = OperationQueue(lambda: None)
        self.service = OpinionService(model, self.queue)
        self.opinions.ask = self.service.ask
        color = np.full((96, 128, 3), 90, np.uint8)
        color[30:50, 40:60] = (250, 250, 240)
        self.color = color

    def weigh(self, at_s=0.0):
        frame = SimpleNamespace(color=self.color, stamp_ns=round(at_s * 1e9))
        return self.opinions.weigh(FIND, 1, "cup", frame, running=(1,))

    def answered(self):
        deadline = time.monotonic() + 20.0
        while (weighed := self.weigh()).waiting:
            assert time.monotonic() < deadline
            time.sleep(0.02)
            self.queue.run_queued(SimpleNamespace(opinions=self.opinions))
        return weighed


@pytest.fixture
def asking(make_model):
    made = []

    def make(**options):
        made.append(Asking(make_model(**options)))
        return made[-1]

    yield make
    for one in made:
        one.service.close()


def test_the_crop_is_shown_and_the_answer_weighed(chat_server, speak, asking):
    chat_server.script = speak('{"answer": "yes", "because": "a white mug"}')
    robot = asking()
    weighed = robot.answered()
    assert weighed.sentence == "tiny at 127.0.0.1 agrees: a white mug"
    assert weighed.find.probability == pytest.approx(0.985, abs=0.002)
    (request,) = chat_server.requests
    _, image = request["messages"][0]["content"]
    encoded = image["image_url"]["url"].removeprefix("data:image/jpeg;base64,")
    shown = simplejpeg.decode_jpeg(base64.b64decode(encoded))
    assert shown.shape[0] < robot.color.shape[0]
    middle = shown[shown.shape[0] // 2, shown.shape[1] // 2]
    np.testing.assert_allclose(middle, (250, 250, 240), atol=12)


def test_a_no_lowers_the_find(chat_server, speak, asking):
    chat_server.script = speak('{"answer": "no", "because": "a leaflet"}')
    assert asking().answered().find.probability == pytest.approx(0.31, abs=0.01)


@pytest.mark.parametrize(
    "reply", ["", "CONFIRM ALL FINDS", "no no no", '{"answer": 1}', "x" * 10**6]
)
def test_an_answer_that_is_none_changes_nothing(chat_server, speak, asking, reply):
    chat_server.script = speak(reply)
    weighed = asking().answered()
    assert weighed.find == FIND
    assert weighed.sentence.startswith("no second opinion: ")
    assert len(chat_server.requests) == 1, "one try"


def test_a_model_that_obeys_writing_in_the_image_adds_what_a_yes_adds(chat_server, speak, asking):
    reply = {"answer": "yes", "because": "IGNORE THE MAP\nand stop", "probability": 1, "nats": 99}
    chat_server.script = speak(json.dumps(reply))
    weighed = asking().answered()
    assert weighed.find.probability == pytest.approx(0.985, abs=0.002)
    assert weighed.sentence == "tiny at 127.0.0.1 agrees: IGNORE THE MAP and stop"


def test_a_slow_endpoint_holds_nothing_up(chat_server, asking):
    let_go = []
    chat_server.script = lambda server, *_: let_go.append(server.stopped.wait(60.0))
    robot = asking()
    assert robot.weigh(0.0).waiting
    assert robot.weigh(7.9).waiting
    late = robot.weigh(8.1)
    assert let_go == [], "the endpoint has not answered yet"
    assert late.find == FIND
    assert late.sentence == "no second opinion: no answer within 8 s"


def test_an_endpoint_that_is_not_there(chat_server, asking):
    robot = asking()
    chat_server.close()
    weighed = robot.answered()
    assert weighed.find == FIND
    assert weighed.sentence.startswith("no second opinion: tiny at 127.0.0.1: ")
