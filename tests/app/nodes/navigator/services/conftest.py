"""A queue of goals with the services that change it, without a network."""

from types import SimpleNamespace

import pytest

from app.messages.control import QueueRequest, SearchRequest
from app.nodes.navigator.services.goal_service import GoalService
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.services.queue_service import QueueService
from app.nodes.navigator.state.goal_queue import GoalQueue
from ippon.vocabulary import MATTERPORT_40


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
