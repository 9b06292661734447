import dataclasses
import threading
from types import SimpleNamespace

import msgspec
import pytest

from app.links.network.requests import RequestRefusedError
from app.messages import keys
from app.messages.control import ControlRequest, FeedbackRequest, SearchRequest
from app.nodes.navigator.services.goal_service import GoalService
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.services.request_services import declare_endpoints
from app.nodes.navigator.state.goal_queue import GoalQueue
from ippon.guidance.levels import Level
from ippon.vocabulary import MATTERPORT_40
from tests.app.nodes.console.drawn_home import status_of
from tests.app.nodes.navigator.conftest import finds


class Recorder:
    """Stands where the mission would, and notes what it is told."""

    def __init__(self):
        self.calls = []
        self.has_find = True
        self.operator = self.goals = self

    def __getattr__(self, name):
        def call(*arguments):
            self.calls.append((name, *arguments))
            return self.has_find

        return call

    def names(self):
        return [call[0] for call in self.calls]


class StopLatch:
    """Stand where the stream would."""

    def __init__(self):
        self.calls = []
        self.halts = 0
        self.halted = False
        self.before_release = lambda: None

    def hold(self):
        self.halted = True

    def halt(self):
        self.calls.append("halt")
        self.halts += 1
        self.halted = True

    def release(self, if_count):
        self.before_release()
        if if_count == self.halts:
            self.calls.append("release")
            self.halted = False
        return if_count == self.halts


@pytest.fixture
def office(sessions):
    router, client = sessions
    goals = GoalQueue(max_queue=3)
    wheels = StopLatch()
    operations = OperationQueue(wake=lambda: None)
    guidance = GuidanceService(
        MATTERPORT_40,
        goals,
        model=None,
        operations=OperationQueue(wake=lambda: None),
        report_event=lambda *_: None,
    )
    service = GoalService(goals, guidance, stop_latch=wheels, operations=operations)
    endpoints = declare_endpoints(router, "r", service)
    yield SimpleNamespace(
        service=service,
        endpoints=endpoints,
        operations=operations,
        goals=goals,
        wheels=wheels,
        mission=Recorder(),
        client=client,
    )
    guidance.close()


def start(office, wanted="hat"):
    office.service.search(SearchRequest(object=wanted))
    return office.goals.next()[0]


def test_a_search_over_the_wire(office):
    request = b'{"object": "my hat", "context": "I left it on the sofa"}'
    replies = list(office.client.get(f"r/{keys.SEARCH}", payload=request, timeout=5.0))
    reply = msgspec.json.decode(replies[0].ok.payload.to_bytes())
    assert (reply["goal_id"], reply["object"], reply["position"]) == (1, "hat", 0)
    planned = office.goals.next()[0]
    levels = {row.label: row.level for row in planned.guidance.rows}
    assert levels["sofa"] is Level.CERTAIN
    assert tuple(levels) == MATTERPORT_40


def test_whoever_asks_a_robot_that_is_not_heard_is_told(office):
    assert office.service.search(SearchRequest(object="hat")).notes == []
    office.service.state = "lost"
    (note,) = office.service.search(SearchRequest(object="plant")).notes
    assert note.startswith("images or pose of the robot are missing: ippon doctor --robot")


@pytest.mark.parametrize(
    ("state", "told"),
    [
        ("stopped", "the robot is stopped: the search begins after Resume"),
        ("paused", "the robot is paused: the search begins after Resume"),
        ("manual", "a person drives the robot: the search begins in Auto"),
    ],
)
def test_whoever_asks_a_robot_that_is_held_is_told_when_it_searches(office, state, told):
    office.service.state = state
    assert office.service.search(SearchRequest(object="hat")).notes == [told]


def test_an_empty_object_and_a_full_queue_are_refused(office):
    with pytest.raises(RequestRefusedError, match="the object is empty"):
        office.service.search(SearchRequest(object="  "))
    with pytest.raises(RequestRefusedError, match="no object in"):
        office.service.search(SearchRequest(object="?!"))
    for _ in range(3):
        office.service.search(SearchRequest(object="hat"))
    with pytest.raises(RequestRefusedError, match="too many goals are waiting"):
        office.service.search(SearchRequest(object="hat"))


def test_more_than_can_be_counted_are_refused(office):
    assert start(office, "99 cups").goal.count == 99
    with pytest.raises(RequestRefusedError, match="at most 99 of one kind are counted; got 150"):
        office.service.search(SearchRequest(object="150 cups"))


@pytest.mark.parametrize("goal_id", [None, 7])
def test_stop_reaches_the_wheels_before_the_mission(office, goal_id):
    reply = office.service.control(ControlRequest(action="stop", goal_id=goal_id))
    assert (reply.state, office.wheels.calls, office.mission.calls) == ("stopped", ["halt"], [])
    office.operations.run_queued(office.mission)
    assert office.mission.names() == ["stop"]


def test_a_stop_over_the_wire_holds_the_wheels_before_its_turn(office):
    held = threading.Event()
    office.wheels.hold = held.set
    payload = b'{"action": "stop"}'
    (reply,) = office.client.get(f"r/{keys.CONTROL}", payload=payload, timeout=5.0)
    assert b"stopped" in reply.ok.payload.to_bytes()
    assert held.is_set()


def test_a_stop_right_after_a_resume_holds(office):
    office.service.control(ControlRequest(action="resume"))
    office.service.control(ControlRequest(action="stop"))
    office.operations.run_queued(office.mission)
    assert office.mission.names() == ["stop"]
    assert office.wheels.halted


def test_a_stop_in_the_middle_of_a_resume_is_never_undone(office):
    office.service.control(ControlRequest(action="stop"))
    office.operations.run_queued(office.mission)
    office.service.control(ControlRequest(action="resume"))
    # The request comes in another thread, just before the mission's thread lets commands pass.
    office.wheels.before_release = lambda: office.service.control(ControlRequest(action="stop"))
    office.operations.run_queued(office.mission)
    assert office.wheels.calls == ["halt", "halt"]
    assert office.wheels.halted
    assert office.mission.names() == ["stop", "stop"]


def test_an_operation_that_fails_is_logged_and_the_next_one_runs(office, caplog):
    office.operations.enqueue(lambda _: 1 // 0)
    office.service.control(ControlRequest(action="pause"))
    office.operations.run_queued(office.mission)
    assert office.mission.names() == ["pause"]
    assert "ZeroDivisionError" in caplog.text


def test_only_resume_releases_the_wheels(office):
    office.service.control(ControlRequest(action="stop"))
    office.service.control(ControlRequest(action="pause"))
    start(office)
    office.operations.run_queued(office.mission)
    assert "release" not in office.wheels.calls
    office.service.control(ControlRequest(action="resume"))
    office.operations.run_queued(office.mission)
    assert not office.wheels.halted


def test_cancel_ends_the_goal_it_was_said_of_and_no_other(office):
    with pytest.raises(RequestRefusedError, match="no goal to cancel"):
        office.service.control(ControlRequest(action="cancel"))
    start(office, "hat")
    office.service.control(ControlRequest(action="cancel"))
    # Before the mission's thread gets to it, the goal is found and the next one starts.
    office.goals.conclude("found")
    assert start(office, "mug").goal.object == "mug"
    office.operations.run_queued(office.mission)
    assert office.mission.calls == []
    assert office.goals.active().goal.object == "mug"


def test_cancel(office):
    start(office)
    reply = office.service.control(ControlRequest(action="cancel"))
    assert reply.detail == "the search for hat was cancelled"
    office.operations.run_queued(office.mission)
    assert office.mission.names() == ["cancel_goal"]
    assert office.goals.active() is None


def test_a_cancelled_find_stays_a_find(office):
    start(office)
    office.goals.conclude("found")
    reply = office.service.control(ControlRequest(action="cancel"))
    assert reply.detail == "the search for hat had ended: found"
    office.operations.run_queued(office.mission)
    active, _, history = office.goals.statuses()
    assert active is None
    assert [goal.outcome for goal in history] == ["found"]


def test_feedback_belongs_to_a_find(office):
    with pytest.raises(RequestRefusedError, match="there is no find"):
        office.service.feedback(FeedbackRequest(verdict="reject"))
    start(office)
    office.goals.conclude("found")
    office.service.state = "found"
    office.service.feedback(FeedbackRequest(verdict="confirm"))
    office.operations.run_queued(office.mission)
    assert office.goals.statuses()[0].outcome == "found"
    office.service.feedback(FeedbackRequest(verdict="reject"))
    office.operations.run_queued(office.mission)
    assert "reject_find" in office.mission.names()
    assert office.goals.statuses()[0].outcome == "active"


@pytest.mark.parametrize("state", ["stopped", "paused", "manual", "lost", "ended"])
@pytest.mark.parametrize("verdict", ["confirm", "reject"])
def test_a_find_is_judged_whatever_the_robot_does_since(office, state, verdict):
    start(office)
    office.service.state = "found"
    with pytest.raises(RequestRefusedError, match="there is no find"):
        office.service.feedback(FeedbackRequest(verdict=verdict))
    office.goals.conclude("found")
    office.service.state = state
    with pytest.raises(RequestRefusedError, match="there is no find of goal 7"):
        office.service.feedback(FeedbackRequest(verdict=verdict, goal_id=7))
    office.service.feedback(FeedbackRequest(verdict=verdict))
    office.operations.run_queued(office.mission)
    assert office.mission.calls == [(f"{verdict}_find", None, None)]


def test_one_of_several_finds_is_judged_by_its_number(office):
    start(office)
    first, last = finds(2)
    office.goals.note_finds(1, (first,), ())
    office.service.state = "searching"
    with pytest.raises(RequestRefusedError, match="there is no find 2 to confirm"):
        office.service.feedback(FeedbackRequest(verdict="confirm", find=2))
    office.service.feedback(FeedbackRequest(verdict="confirm", find=1))
    office.goals.conclude("found", 1, last)
    office.service.feedback(FeedbackRequest(verdict="confirm", find=2))
    office.operations.run_queued(office.mission)
    assert office.goals.statuses()[0].confirmed, "it is the one that ended the search"
    office.service.feedback(FeedbackRequest(verdict="reject", goal_id=1, find=1))
    office.operations.run_queued(office.mission)
    assert office.mission.calls == [
        ("confirm_find", 1, 1), ("confirm_find", 1, None), ("reject_find", 1, 1),
    ]  # fmt: skip
    assert office.goals.statuses()[0].outcome == "active", "another one is missing"


def test_a_find_of_a_tour_is_named_with_its_goal(office):
    start_tour(office)
    office.goals.note_finds(1, finds(1), ())
    with pytest.raises(RequestRefusedError, match="name the goal of find 1, too"):
        office.service.feedback(FeedbackRequest(verdict="reject", find=1))
    with pytest.raises(RequestRefusedError, match="there is no find 1"):
        office.service.feedback(FeedbackRequest(verdict="reject", goal_id=2, find=1))
    office.service.feedback(FeedbackRequest(verdict="reject", goal_id=1, find=1))
    office.operations.run_queued(office.mission)
    assert office.mission.calls == [("reject_find", 1, 1)]


def test_a_find_of_a_tour_that_is_confirmed_can_no_longer_be_rejected(office):
    start_tour(office)
    first, last = finds(2)
    office.goals.note_finds(1, (first,), ())
    office.goals.conclude("found", 1, last)

    def reject(number):
        office.service.feedback(FeedbackRequest(verdict="reject", goal_id=1, find=number))

    office.service.feedback(FeedbackRequest(verdict="confirm", goal_id=1))
    office.operations.run_queued(office.mission)
    with pytest.raises(RequestRefusedError, match="there is no find 2 to confirm or reject"):
        reject(2)
    office.goals.note_finds(1, (dataclasses.replace(first, confirmed=True),), ())
    with pytest.raises(RequestRefusedError, match="there is no find 1 to confirm or reject"):
        reject(1)
    # Nobody has judged the first one yet: the goal goes on without it.
    office.goals.note_finds(1, (first,), ())
    reject(1)
    office.operations.run_queued(office.mission)
    assert office.mission.calls == [("confirm_find", 1, None), ("reject_find", 1, 1)]


def start_tour(office):
    """Search for a hat and a mug in one tour, in which both were found, the mug last."""
    office.service.search(SearchRequest(object="hat"))
    accepted = office.service.search(SearchRequest(object="mug", joins=1))
    assert (accepted.goal_id, accepted.position, accepted.joined) == (2, 0, 1)
    assert len(office.goals.next()) == 2
    for goal_id in (1, 2):
        office.goals.conclude("found", goal_id)


def test_feedback_is_about_the_find_announced_last_or_the_one_that_is_named(office):
    start_tour(office)
    # The tour's state need not be "found": another goal may still be searched for.
    office.service.state = "searching"
    office.service.feedback(FeedbackRequest(verdict="confirm"))
    office.operations.run_queued(office.mission)
    assert office.mission.calls == [("confirm_find", 2, None)]
    with pytest.raises(RequestRefusedError, match="no find of goal 2 to confirm"):
        office.service.feedback(FeedbackRequest(verdict="reject", goal_id=2))
    office.service.feedback(FeedbackRequest(verdict="reject", goal_id=1))
    office.operations.run_queued(office.mission)
    assert office.mission.calls[1:] == [("reject_find", 1, None)]
    assert [goal.outcome for goal in office.goals.tour()] == ["active", "found"]
    with pytest.raises(RequestRefusedError, match="there is no find to confirm"):
        office.service.feedback(FeedbackRequest(verdict="confirm"))


def test_a_tour_is_cancelled_as_a_whole_or_goal_by_goal(office):
    start_tour(office)
    office.goals.reopen(1)
    with pytest.raises(RequestRefusedError, match="no goal with number 7 to cancel"):
        office.service.control(ControlRequest(action="cancel", goal_id=7))
    with pytest.raises(RequestRefusedError, match="only cancel is about one goal"):
        office.service.control(ControlRequest(action="pause", goal_id=1))
    reply = office.service.control(ControlRequest(action="cancel", goal_id=1))
    assert reply.detail == "the search for hat was cancelled", "not for the leading one"
    office.operations.run_queued(office.mission)
    assert office.mission.calls == [("cancel_goal", 1)]
    assert [goal.object for goal in office.goals.statuses()[2]] == ["hat"]
    assert office.goals.active().goal.object == "mug"
    office.service.control(ControlRequest(action="cancel"))
    office.operations.run_queued(office.mission)
    assert office.mission.calls[1:] == [("cancel_goal",)]
    assert office.goals.active() is None


def test_a_goal_that_cannot_join_waits_and_says_why(office):
    office.service.search(SearchRequest(object="hat"))
    accepted = office.service.search(SearchRequest(object="my hat", joins=1))
    assert (accepted.position, accepted.joined) == (1, None)
    assert accepted.notes[0] == "hat is in the tour of goal 1 already: this is a search of its own"


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"object": "h\x07at"}, "the object holds a control character"),
        ({"object": "hat", "context": "on the\x1b[2J sofa"}, "the context holds a control"),
        ({"object": " \n "}, "the object is empty; name an object"),
    ],
)
def test_text_that_cannot_be_read_is_refused_with_the_reason(office, fields, text):
    with pytest.raises(RequestRefusedError, match=text):
        office.service.search(SearchRequest(**fields))
    assert office.goals.active() is None


def test_markup_is_only_text(office):
    accepted = office.service.search(SearchRequest(object="<b>hat</b>"))
    assert accepted.position == 0


@pytest.mark.parametrize("field", ["object", "context", "scenario"])
def test_ten_thousand_characters_are_refused_with_the_bound(office, field):
    request = {"object": "hat", field: "x" * 10_000}
    payload = msgspec.json.encode(request)
    (reply,) = list(office.client.get("r/search", payload=payload))
    text = reply.ok.payload.to_string()
    assert "not a SearchRequest" in text
    assert "length <=" in text
    assert f"$.{field}" in text


def test_a_goal_for_a_free_robot_is_refused_by_one_that_is_not(office):
    free = SearchRequest(object="mug", if_free=True)
    office.service.availability.status = status_of("starting", frames=5)

    def answer(state):
        office.service._operations = SimpleNamespace(ask=lambda _: state, wake=lambda: None)

    answer("stopped")
    with pytest.raises(RequestRefusedError, match="not free any more: stopped"):
        office.service.search(free)
    answer("starting")
    assert office.service.search(free).position == 0
    with pytest.raises(RequestRefusedError, match=r"not free any more: searching \(mug\)"):
        office.service.search(free)
    assert len(office.goals.unfinished()) == 1
    assert office.service.search(SearchRequest(object="hat")).position == 1, "others may wait"


def test_of_two_goals_at_once_for_a_free_robot_one_is_refused(office):
    search = office.service.plan(SearchRequest(object="mug"))
    search = dataclasses.replace(search, if_idle=True)
    assert office.goals.add(search).position == 0
    assert office.goals.add(search) is None
    assert len(office.goals.unfinished()) == 1


def test_all_goals_of_a_tour_that_is_cancelled_are_named(office):
    start_tour(office)
    office.goals.reopen(1)
    reply = office.service.control(ControlRequest(action="cancel"))
    assert reply.detail == "the search for hat was cancelled", "the mug was found before"
    office.goals.reopen(2)
    reply = office.service.control(ControlRequest(action="cancel"))
    assert reply.detail == "the search for hat and mug was cancelled"
