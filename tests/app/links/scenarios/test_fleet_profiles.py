"""Several robots under the access rules of `ippon certificates`: listed, asked, given a goal."""

import datetime as dt
import time

import pytest

from app.certificates.roles import write_roles
from app.links.fleet.assignment import assign
from app.links.fleet.navigators import live_navigators
from app.links.network import session
from app.links.network.requests import ask, serve
from app.links.network.session import PROFILE, LinkError, open_client, open_router
from app.messages import keys
from app.messages.control import (
    Bid,
    BidRequest,
    ControlReply,
    ControlRequest,
    SearchAccepted,
    SearchRequest,
    encode,
)
from app.nodes.console.fleet import robot_list
from app.nodes.console.fleet.robot_list import RobotList
from tests.app.conftest import PATIENT_LEASE_MS
from tests.app.nodes.console.drawn_home import status_of
from tests.ports import free_port

ROBOTS = ("near", "site/far")
WAYS_M = {"near": 2.0, "site/far": 9.0}


class Robot:
    """A navigator's router with what the fleet asks for."""

    def __init__(self, name, endpoint):
        self.router, self.goals = open_router(endpoint), []
        bid = Bid(obstacle="", ground="room", place="kitchen", way_m=WAYS_M[name])
        key = f"{name}/{keys.STATUS}"
        self._served = [
            serve(self.router, f"{name}/{keys.BID}", BidRequest, lambda _: bid),
            serve(self.router, f"{name}/{keys.SEARCH}", SearchRequest, self._search),
            serve(
                self.router,
                f"{name}/{keys.CONTROL}",
                ControlRequest,
                lambda _: ControlReply(state="stopped"),
            ),
            self.router.declare_queryable(
                key, lambda query: query.reply(key, encode(status_of(robot=name)))
            ),
        ]
        self._alive = self.router.liveliness().declare_token(f"{name}/{keys.NAVIGATOR_ALIVE}")

    def _search(self, request):
        self.goals.append(request)
        return SearchAccepted(goal_id=1, object=request.object, position=0)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Two robots, the router of the second joined to that of the first, by certificates."""
    folder = tmp_path_factory.mktemp("tls")
    now = dt.datetime.now(dt.UTC)
    write_roles(folder, robots=ROBOTS, hosts=("localhost", "127.0.0.1"), days=2, now=now)
    endpoints = [f"tls/127.0.0.1:{free_port()}" for _ in ROBOTS]
    rules = (folder / "navigator.json5").read_text()
    join = f'{{\n  connect: {{ endpoints: ["{endpoints[0]}"] }},'
    (folder / "joined.json5").write_text(rules.replace("{", join, 1))
    opened = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "LEASE_MS", PATIENT_LEASE_MS)

        def become(role):
            patch.setenv(PROFILE, str(folder / f"{role}.json5"))

        def connect(role, at=0):
            become(role)
            opened.append(open_client(endpoints[at], 5.0))
            deadline = time.monotonic() + 20.0
            while role != "recorder" and live_navigators(opened[-1]) != list(ROBOTS):
                assert time.monotonic() < deadline, live_navigators(opened[-1])
            return opened[-1]

        become("navigator")
        robots = {ROBOTS[0]: Robot(ROBOTS[0], endpoints[0])}
        become("joined")
        robots[ROBOTS[1]] = Robot(ROBOTS[1], endpoints[1])
        connect.become, connect.endpoints, connect.robots = become, endpoints, robots
        yield connect
        for one in opened:
            one.close()
        for robot in robots.values():
            robot.router.close()


@pytest.mark.parametrize("role", ["console", "requester"])
@pytest.mark.parametrize("at", [0, 1])
def test_both_routers_list_both_robots_and_the_nearest_gets_the_goal(site, role, at):
    session = site(role, at)
    for robot in site.robots.values():
        robot.goals.clear()
    result = assign(session, SearchRequest(object="mug", context="in the kitchen"), lambda _: None)
    assert result.given is not None, result
    assert (result.given.name, result.given.bid.way_m) == ("near", 2.0)
    (goal,) = site.robots["near"].goals
    assert (goal.object, goal.if_free) == ("mug", True)
    assert site.robots["site/far"].goals == []
    assert [one.bid.way_m for one in result.others] == [9.0]


@pytest.mark.parametrize("at", [0, 1])
def test_the_console_shows_the_list(site, at, monkeypatch):
    monkeypatch.setattr(robot_list, "FRESH_S", 0.0)
    site("console", at)
    listed = RobotList(site.endpoints[at])
    shown = listed.shown()
    listed.close()
    assert shown.problem == ""
    assert [(one.name, one.link, one.state) for one in shown.robots] == [
        (name, "live", "searching") for name in ROBOTS
    ]


def test_a_recorder_and_a_robot_ask_nobody(site):
    for role, listed in (("recorder", ["near", "site/far"]), ("robot", [])):
        site.become(role)
        session = open_client(site.endpoints[0], 5.0)
        assert sorted(live_navigators(session)) == listed
        request = BidRequest(search=SearchRequest(object="mug"))
        with pytest.raises(LinkError, match="no reply on near/bid"):
            ask(session, "near/bid", request, Bid, 0.5)
        session.close()


def test_a_requester_stops_the_other_robot_through_the_joined_router_and_drives_none(site):
    session = site("requester")
    stop = ControlRequest(action="stop")
    assert ask(session, "site/far/control", stop, ControlReply, 2.0).state == "stopped"
    heard = []
    far = site.robots["site/far"].router
    watching = far.declare_subscriber("site/far/cmd_vel", heard.append)
    session.put("site/far/cmd_vel", b"go")
    assert ask(session, "site/far/control", stop, ControlReply, 2.0).state == "stopped"
    assert heard == []
    del watching
