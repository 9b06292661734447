"""What tests of the guidance share: a stand-in for the model, and a real map."""

import dataclasses
import queue
import threading
from types import SimpleNamespace

import pytest

from app.links.language_model.interface import LevelsAnswer, ObjectNames, SentenceAnswer
from app.messages.control import QueueRequest, SearchRequest
from app.nodes.navigator.services.goal_service import GoalService
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.services.queue_service import QueueService
from app.nodes.navigator.services.request_services import declare_endpoints
from app.nodes.navigator.services.sentence_service import SentenceService
from app.nodes.navigator.state.goal_queue import GoalQueue
from ippon.guidance.language.goals.goal import Goal, Request
from ippon.guidance.levels import Guidance, LabelLevel, Level
from ippon.guidance.prior import PROVIDER
from ippon.mapping.voxel_map import MapConfig
from ippon.mission.config import MissionConfig
from ippon.mission.mission import Mission
from ippon.mission.snapshot import Find
from ippon.robot import ZED
from ippon.vocabulary import MATTERPORT_40

MODEL = "tiny at 127.0.0.1"


class Model:
    """Answers when it is let, with one level for everything."""

    name = MODEL

    def __init__(self):
        self.asked = queue.SimpleQueue()
        self.may_answer = threading.Semaphore(0)
        self.level = Level.NEAR
        self.failed = ""
        self.labels = None
        self.closed = False

    def levels(self, ooi, context, vocabulary, *, scenario):
        self.asked.put((ooi.display, context, vocabulary, scenario))
        self.may_answer.acquire(timeout=120.0)
        rows = tuple(LabelLevel(label=x, level=self.level, reason="so") for x in vocabulary)
        provider = PROVIDER if self.failed else MODEL
        notes = (f"{MODEL}: {self.failed}; the embedded prior answered instead",)
        return LevelsAnswer(
            guidance=Guidance(
                ooi=ooi.canonical,
                context=context,
                provider=provider,
                rows=rows,
                notes=notes if self.failed else (),
            ),
            prompt="the question",
            reply="the answer",
            elapsed_ms=1234.0,
            from_cache=False,
            failed=self.failed,
        )

    def read_request(self, sentence, previous=()):
        self.may_answer.acquire(timeout=120.0)
        return SentenceAnswer(
            Request(goals=(Goal(object="hat", display="hat"),), doubtful=False), MODEL, "q", "a", ""
        )

    def read_picture(self, jpeg):
        self.may_answer.acquire(timeout=120.0)
        request = Request(goals=(Goal(object="mug", display="red mug"),), doubtful=False)
        return SentenceAnswer(request, MODEL, "q", "a", "")

    def name_objects(self, jpeg, vocabulary):
        self.asked.put((jpeg[:2], len(vocabulary)))
        self.may_answer.acquire(timeout=120.0)
        return ObjectNames(("bookcase", "hat", "bookcase"))

    def close(self):
        self.closed = True
        self.may_answer.release(100)


@pytest.fixture
def open_office(sessions):
    """Return a factory of guidance services whose operations run on a real mission."""
    router, client = sessions
    opened = []

    def make(model=None, look_every_s=0.0):
        goals = GoalQueue(max_queue=5)
        operations, events = queue.SimpleQueue(), []
        guidance = GuidanceService(
            MATTERPORT_40,
            goals,
            model=model,
            look_every_s=look_every_s,
            operations=SimpleNamespace(enqueue=operations.put, wake=lambda: None),
            report_event=lambda kind, text: events.append((kind, text)),
        )
        sentences = SentenceService(model, goals)
        endpoints = [declare_endpoints(router, "r", service) for service in (guidance, sentences)]
        config = MissionConfig(map=MapConfig(voxel_size_m=0.2, memory_limit_mb=128.0))
        mission = Mission(config, ZED, MATTERPORT_40, seed=0)
        office = SimpleNamespace(
            guidance=guidance,
            endpoints=endpoints,
            sentences=sentences,
            goals=goals,
            mission=mission,
            events=events,
            client=client,
            model=model,
        )
        office.operations = operations
        opened.append(office)
        return office

    yield make
    for office in opened:
        office.guidance.close()
        office.sentences.close()


def search(office, wanted="hat", context="on the sofa", start=True):
    """Do what the service and the node do with a request."""
    planned = office.guidance.plan(SearchRequest(object=wanted, context=context), 0.0)
    goal_id = office.goals.add(planned).goal_id
    office.guidance.consult(goal_id)
    if start:
        active = office.guidance.fitted(office.goals.next()[0])
        office.mission.goals.set_goal(active.goal, active.guidance)
    return goal_id


def run_next(office):
    office.operations.get(timeout=120.0)(office.mission)


def levels(office):
    return {row.label: row.level for row in office.goals.active().guidance.rows}


@pytest.fixture
def desk():
    """A queue with the hat searched for, and some goals waiting."""
    queue = GoalQueue(max_queue=20)
    operations = OperationQueue(wake=lambda: None)
    guidance = GuidanceService(
        MATTERPORT_40, queue, model=None, operations=operations, report_event=lambda *_: None
    )
    latch = SimpleNamespace(halts=0, halt=lambda: None, release=lambda **_: True)
    goals = GoalService(queue, guidance, stop_latch=latch, operations=operations)
    service = QueueService(queue, guidance, goals)

    def ask(goal_id, action, **more):
        return service.queue(QueueRequest(goal_id=goal_id, action=action, **more)).detail

    def waiting():
        return [goal.goal_id for goal in queue.statuses()[1]]

    def search(name, joins=None, context=""):
        goals.search(SearchRequest(object=name, joins=joins, context=context))

    search("hat", context="on the sofa")
    queue.next()
    return SimpleNamespace(
        queue=queue, goals=goals, guidance=guidance, ask=ask, waiting=waiting, search=search
    )


def finds(count):
    """Return finds one metre apart, numbered from 1."""
    one = Find(
        position_world=(0.0, 2.0, 0.5), size_m=(0.4, 0.4, 0.9), probability=0.9, voxels=40,
        box_px=None,
    )  # fmt: skip
    return [
        dataclasses.replace(one, position_world=(float(n), 2.0, 0.5), number=n)
        for n in range(1, count + 1)
    ]
