"""One search to one robot, on a real router: also when others give goals at the same time."""

import threading

import pytest

from app.links.fleet import assignment
from app.links.fleet.assignment import assign
from app.links.fleet.bids import in_order
from app.links.network.requests import RequestRefusedError, serve
from app.links.network.session import open_client
from app.messages import keys
from app.messages.control import Bid, BidRequest, SearchAccepted, SearchRequest

MUG, HAT = SearchRequest(object="mug"), SearchRequest(object="hat")


class Robot:
    """A navigator that takes one goal at a time."""

    def __init__(self, session, name, way_m, obstacle=""):
        self.goals = []
        self.takes = True
        self.answers = threading.Event()
        self.answers.set()
        bid = Bid(obstacle=obstacle, ground="room", place="kitchen", way_m=way_m)
        self._lock = threading.Lock()
        self._served = [
            serve(session, f"{name}/{keys.BID}", BidRequest, lambda _: bid),
            serve(session, f"{name}/{keys.SEARCH}", SearchRequest, self._search),
            session.liveliness().declare_token(f"{name}/{keys.NAVIGATOR_ALIVE}"),
        ]

    def _search(self, request):
        assert request.if_free
        with self._lock:
            if self.goals or not self.takes:
                raise RequestRefusedError("it is not free any more: searching")
            self.goals.append(request.object)
        self.answers.wait(10.0)
        return SearchAccepted(goal_id=1, object=request.object, position=0)


@pytest.fixture
def fleet(sessions):
    """A near and a far robot, and one that is nearer and not free."""
    router, client = sessions
    robots = {
        "far": Robot(router, "far", 9.0),
        "near": Robot(router, "near", 2.0),
        "busy": Robot(router, "busy", 0.5, obstacle="searching"),
    }
    return robots, client


def test_the_nearest_free_robot_gets_it_and_the_others_are_listed(fleet):
    robots, client = fleet
    result = assign(client, MUG, lambda _: None)
    assert (result.given.name, result.accepted.object) == ("near", "mug")
    assert [one.name for one in result.others] == ["far", "busy"]
    assert [robots[name].goals for name in ("near", "far", "busy")] == [["mug"], [], []]


def test_one_that_was_taken_in_the_meantime_is_passed_over(fleet):
    robots, client = fleet
    robots["near"].takes = False
    result = assign(client, MUG, lambda _: None)
    assert result.given.name == "far"
    assert [(one.name, one.problem) for one in result.others] == [("near", "refused"), ("busy", "")]
    assert "not free any more" in result.others[0].detail


def test_two_people_at_once_get_two_robots(fleet, free_endpoint, monkeypatch):
    robots, client = fleet
    both_have_bids = threading.Barrier(2)
    second = open_client(free_endpoint, 5.0)
    results = {}

    def wait_for_both(bids):
        # Both have the same bids before either sends its goal.
        both_have_bids.wait(10.0)
        return in_order(bids)

    def give(session, search):
        results[search.object] = assign(session, search, lambda _: None)

    monkeypatch.setattr(assignment, "in_order", wait_for_both)

    threads = [threading.Thread(target=give, args=pair) for pair in ((client, MUG), (second, HAT))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20.0)
    second.close()
    assert {results["mug"].given.name, results["hat"].given.name} == {"near", "far"}
    assert sorted(robots["near"].goals + robots["far"].goals) == ["hat", "mug"]
    assert robots["busy"].goals == []


def test_a_third_goal_finds_nobody_and_nothing_is_queued(fleet):
    robots, client = fleet
    for wanted in (MUG, HAT):
        assert assign(client, wanted, lambda _: None).given is not None
    result = assign(client, SearchRequest(object="keys"), lambda _: None)
    assert result.given is result.unsure is None
    assert [len(robots[name].goals) for name in ("near", "far", "busy")] == [1, 1, 0]
    assert {one.name for one in result.others} == {"near", "far", "busy"}


def test_a_robot_that_does_not_confirm_leaves_the_others_alone(fleet, monkeypatch):
    robots, client = fleet
    monkeypatch.setattr(assignment, "REPLY_S", 0.5)
    robots["near"].answers.clear()
    result = assign(client, MUG, lambda _: None)
    assert result.given is None
    assert (result.unsure.name, result.unsure.problem) == ("near", "silent")
    assert robots["far"].goals == [], "or two robots would search for one mug"
    robots["near"].answers.set()


def test_without_robots_nobody_gets_it(sessions):
    result = assign(sessions[1], MUG, lambda _: None)
    assert result == assignment.Assignment(given=None, accepted=None, unsure=None, others=())
