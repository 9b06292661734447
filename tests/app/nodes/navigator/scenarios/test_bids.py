"""A real navigator bids for searches, and takes one at a time."""

import threading
import time
from functools import partial

import pytest

from app.links.fleet import assignment
from app.links.fleet.assignment import assign
from app.links.fleet.bids import ask_for_bids, in_order
from app.links.network.requests import ask
from app.links.network.session import open_client
from app.messages import keys
from app.messages.control import ControlReply, ControlRequest, SearchRequest
from app.messages.lease import Credential, LeaseReply, LeaseRequest
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.services import operation_queue
from app.nodes.navigator.state import lease

MUG, KEYS = SearchRequest(object="mug"), SearchRequest(object="keys")
ANNA = Credential(session="a" * 20, name="Anna")


def nobody(_):
    return None


@pytest.fixture
def config():
    """Images that a busy machine sends late do not count as lost at once."""
    return NavigatorConfig(robot="r", heatmap_lost_s=0.5, lost_s=3.0)


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """Robot, navigator and client share one interpreter here."""
    monkeypatch.setattr(operation_queue, "ANSWER_S", 20.0)
    monkeypatch.setattr(assignment, "REPLY_S", 30.0)
    monkeypatch.setattr(assignment, "ask_for_bids", partial(ask_for_bids, timeout_s=30.0))


@pytest.fixture
def idle(robot, sessions):
    """The robot without a goal, and a client."""
    _, client = sessions
    control(client, "cancel")
    robot.send_until(lambda s: s.goal is None and s.explored_m2 > 1.0)
    return robot, client


def control(client, action):
    ask(client, f"r/{keys.CONTROL}", ControlRequest(action=action), ControlReply, 20.0)


def bid_of(client, search=MUG, who=None):
    (one,) = ask_for_bids(client, ["r"], search, lambda _: who, 20.0)
    assert one.bid is not None, one
    return one.bid


@pytest.mark.slow
def test_a_robot_that_searches_says_so_and_does_not_move_for_the_question(robot, sessions):
    _, client = sessions
    before = robot.send_until(lambda s: s.goal is not None)
    with robot.sending():
        bid = bid_of(client)
    assert (bid.obstacle, bid.detail) == ("searching", "hat")
    after = robot.send_until(lambda s: s.frames > before.frames + 2)
    assert (after.goal, after.queue) == (before.goal, [])


@pytest.mark.slow
def test_a_free_robot_takes_one_goal_and_no_second(idle):
    robot, client = idle
    elsewhere = SearchRequest(object="mug", context="in the bathroom")
    with robot.sending():
        bid, unknown = bid_of(client), bid_of(client, elsewhere)
        result = assign(client, MUG, nobody)
        second = assign(client, KEYS, nobody)
    assert (bid.is_free, bid.ground) == (True, "area")
    assert bid.explored_m2 > 1.0
    assert unknown.ground == "unknown"
    assert (result.given.name, result.accepted.position) == ("r", 0)
    assert second.given is None
    assert second.others[0].bid.obstacle == "searching"
    status = robot.send_until(lambda s: s.goal is not None)
    assert (status.goal.object, status.queue) == ("mug", [])


@pytest.mark.slow
def test_of_two_people_at_once_one_gets_the_robot(idle, free_endpoint, monkeypatch):
    robot, client = idle
    other = open_client(free_endpoint)
    both_have_bids, results = threading.Barrier(2), []

    def wait_for_both(bids):
        both_have_bids.wait(40.0)
        return in_order(bids)

    monkeypatch.setattr(assignment, "in_order", wait_for_both)
    pairs = ((client, MUG), (other, KEYS))
    threads = [
        threading.Thread(target=lambda pair=pair: results.append(assign(*pair, nobody)))
        for pair in pairs
    ]
    with robot.sending():
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60.0)
    other.close()
    given = [one for one in results if one.given is not None]
    refused = [one for one in results if one.given is None]
    assert len(given) == len(refused) == 1
    assert "not free any more" in refused[0].others[0].detail
    status = robot.send_until(lambda s: s.goal is not None)
    assert (status.goal.object, status.queue) == (given[0].accepted.object, [])


@pytest.mark.slow
def test_what_a_person_controls_or_has_stopped_is_left_alone(idle, monkeypatch):
    # Nobody renews the lease here, as a console does.
    monkeypatch.setattr(lease, "EXPIRY_S", 60.0)
    robot, client = idle
    with robot.sending():
        _hold_release_stop_and_resume(client)
    status = robot.send_until(lambda s: s.frames > 0)
    assert (status.goal, status.queue) == (None, [])


def _hold_release_stop_and_resume(client):
    request = LeaseRequest(action="request")
    reply = ask(client, f"r/{keys.LEASE}", request, LeaseReply, 20.0, ANNA)
    assert reply.standing == "holds"
    held = bid_of(client)
    assert (held.obstacle, held.detail) == ("held", "Anna")
    result = assign(client, MUG, nobody)
    assert result.given is None
    own = Credential(session=ANNA.session, name="Anna", epoch=reply.epoch)
    assert bid_of(client, who=own).is_free
    release = LeaseRequest(action="release")
    ask(client, f"r/{keys.LEASE}", release, LeaseReply, 20.0, own)
    control(client, "stop")
    assert bid_of(client).obstacle == "stopped"
    assert assign(client, MUG, nobody).given is None
    control(client, "resume")
    assert bid_of(client).is_free


@pytest.mark.slow
def test_a_robot_whose_data_stop_is_lost(idle):
    robot, client = idle
    deadline = time.monotonic() + 60.0
    while bid_of(client).obstacle != "lost":
        assert time.monotonic() < deadline
        time.sleep(0.1)
    bid = bid_of(client)
    assert "waiting for" in bid.detail
    robot.send_until(lambda s: s.state != "lost")
    with robot.sending():
        assert bid_of(client).is_free
