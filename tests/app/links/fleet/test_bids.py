"""Order of preference, and answers that are no bids, on a real router."""

import itertools
import time

import pytest

from app.links.fleet import navigators
from app.links.fleet.bids import RobotBid, ask_for_bids, in_order
from app.links.fleet.navigators import live_navigators
from app.links.network.requests import RequestRefusedError, serve, serve_with_credential
from app.messages import keys
from app.messages.control import Bid, BidRequest, SearchRequest, encode
from app.messages.lease import Credential
from tests.app.nodes.console.drawn_home import status_of

SEARCH = SearchRequest(object="mug", context="in the kitchen")


def robot(name, ground="room", obstacle="", way_m=None, explored_m2=0.0):
    bid = Bid(obstacle=obstacle, ground=ground, way_m=way_m, explored_m2=explored_m2)
    return RobotBid(name=name, bid=bid)


BEST_FIRST = (
    robot("near", way_m=2.0),
    robot("far", "thing", way_m=9.0),
    robot("no way"),
    robot("large map", "area", way_m=0.0, explored_m2=80.0),
    robot("small map", "area", way_m=0.0, explored_m2=8.0),
    robot("new", "unknown", explored_m2=0.0),
    robot("elsewhere", "unknown", explored_m2=90.0),
)


def test_robots_that_know_the_place_come_first_by_their_way():
    orders = itertools.islice(itertools.permutations(BEST_FIRST), 0, None, 7)
    for order in orders:
        assert in_order(order) == list(BEST_FIRST)


def test_names_decide_between_equals():
    one, other = robot("a", way_m=2.0), robot("b", way_m=2.0)
    assert in_order([other, one]) == [one, other]


@pytest.mark.parametrize("obstacle", ["searching", "held", "manual", "stopped", "lost", "starting"])
def test_who_is_not_free_is_not_asked_however_near(obstacle):
    busy = robot("busy", obstacle=obstacle, way_m=0.1)
    silent = RobotBid(name="silent", problem="silent")
    far = robot("far", way_m=50.0)
    assert in_order([busy, silent, far]) == [far]
    assert in_order([busy, silent]) == []


@pytest.fixture
def network(sessions):
    """A router, a client, and a way to have a robot answer on the router."""
    router, client = sessions
    kept = []

    def add(name, answer=None, version="9.9"):
        key = f"{name}/{keys.BID}"
        if answer is not None:
            kept.append(router.declare_queryable(key, answer))
        status = f"{name}/{keys.STATUS}"
        told = encode(status_of(robot=name, version=version))
        kept.append(router.declare_queryable(status, lambda query: query.reply(status, told)))
        kept.append(router.liveliness().declare_token(f"{name}/{keys.NAVIGATOR_ALIVE}"))

    add.router, add.client, add.kept = router, client, kept
    return add


def test_a_bid_is_asked_with_the_credential_of_the_requester(network):
    heard = []

    def answer(request, who):
        heard.append((request, who))
        return Bid(obstacle="", ground="room", place="kitchen", way_m=3.5)

    network.kept.append(
        serve_with_credential(network.router, f"site/a/{keys.BID}", BidRequest, answer)
    )
    network("site/a")
    who = Credential(session="s" * 20, name="anna", epoch=4)
    (one,) = ask_for_bids(network.client, live_navigators(network.client), SEARCH, lambda _: who)
    assert (one.name, one.bid.place, one.bid.way_m) == ("site/a", "kitchen", 3.5)
    assert heard == [(BidRequest(search=SEARCH), who)]


def test_a_robot_whose_router_has_just_joined_is_no_old_one(network, monkeypatch):
    """Its token may be known before what it serves."""
    monkeypatch.setattr(navigators, "SETTLE_S", 60.0)

    def answer(query):
        query.reply(f"a/{keys.BID}", encode(Bid(obstacle="", ground="room", way_m=9.0)))

    asked, ask_once = [], navigators._ask_once

    def ask(session, questions, timeout_s):
        answers = ask_once(session, questions, timeout_s)
        if not asked:
            network.kept.append(network.router.declare_queryable(f"a/{keys.BID}", answer))
        asked.append(answers["a"])
        return answers

    monkeypatch.setattr(navigators, "_ask_once", ask)
    network("a")
    (a,) = ask_for_bids(network.client, ["a"], SEARCH, lambda _: None, timeout_s=20.0)
    assert a.bid is not None, a
    assert a.bid.way_m == 9.0
    assert (asked[0].payloads, asked[0].timed_out) == ([], False)


def test_answers_that_are_no_bids_are_told_apart(network):
    def nonsense(query):
        query.reply(f"b/{keys.BID}", b'{"obstacle": "tired", "ground": "room"}')

    def backwards(query):
        query.reply(f"c/{keys.BID}", b'{"obstacle": "", "ground": "room", "way_m": -4}')

    def later(query):
        text = b'{"obstacle": "", "ground": "area", "explored_m2": 3, "battery": 0.4}'
        query.reply(f"f/{keys.BID}", text)

    hanging = []

    def refuse(_):
        raise RequestRefusedError("the navigator is busy")

    network("a", version="0.1.0")
    network("b", nonsense)
    network("c", backwards)
    network("d", hanging.append)
    network("f", later)
    network.kept.append(serve(network.router, f"e/{keys.BID}", BidRequest, refuse))
    network("e")
    deadline = time.monotonic() + 20.0
    while live_navigators(network.client) != ["a", "b", "c", "d", "e", "f"]:
        assert time.monotonic() < deadline
    began = time.monotonic()
    (d,) = ask_for_bids(network.client, ["d"], SEARCH, lambda _: None, timeout_s=0.5)
    assert time.monotonic() - began < 10.0
    others = ["a", "b", "c", "e", "f"]
    a, b, c, e, f = ask_for_bids(network.client, others, SEARCH, lambda _: None, timeout_s=20.0)
    assert (a.problem, a.detail) == ("old", "0.1.0")
    assert b.problem == c.problem == "unreadable"
    assert "tired" in b.detail
    assert "way_m" in c.detail
    assert d.problem == "silent"
    assert (e.problem, e.detail) == ("refused", "the navigator is busy")
    assert f.bid == Bid(obstacle="", ground="area", explored_m2=3.0), "a later version says more"
    hanging.clear()


def test_two_navigators_of_one_name_get_nothing(network):
    bid = Bid(obstacle="", ground="area")
    network.kept.append(serve(network.router, f"a/{keys.BID}", BidRequest, lambda _: bid))
    network("a")
    network.kept.append(serve(network.client, f"a/{keys.BID}", BidRequest, lambda _: bid))
    deadline = time.monotonic() + 10.0
    while True:
        (one,) = ask_for_bids(network.router, ["a"], SEARCH, lambda _: None)
        if one.problem == "twice":
            break
        assert time.monotonic() < deadline
