"""Navigators as a router shows them: a token, a status, a pose; without a map."""

import threading
import time

import msgspec

from app.links.fleet.navigators import live_navigators
from app.links.language_model.interface import RULES, SentenceAnswer
from app.links.language_model.sentence_reading import as_reading
from app.links.network.requests import RequestRefusedError, serve, serve_with_credential
from app.links.network.session import open_client
from app.messages import keys
from app.messages.control import (
    Bid,
    BidRequest,
    SearchAccepted,
    SearchRequest,
    SentenceRequest,
    encode,
)
from app.messages.motion import StampedTransform, encode_transforms
from app.messages.status import GoalStatus
from app.nodes.navigator.config import NavigatorConfig
from ippon.geometry import base_pose
from ippon.guidance.language.requests.sentence import read_request
from ippon.robot import ZED
from tests.app.nodes.console.drawn_home import status_of


def wait_until_listed(zenoh_port, names, timeout_s=20.0):
    """Wait until a router lists navigators: a token takes a moment to get there."""
    session = open_client(f"tcp/127.0.0.1:{zenoh_port}")
    deadline = time.monotonic() + timeout_s
    while not set(names) <= set(live_navigators(session)):
        assert time.monotonic() < deadline
    session.close()


def room(way_m, obstacle="", detail=""):
    """Return the bid of a robot that knows the room."""
    return Bid(obstacle=obstacle, detail=detail, ground="room", place="kitchen", way_m=way_m)


class LightNavigator:
    """One navigator that searches for an object and publishes at a rate.

    `before` is what its status says instead until it takes a search.
    """

    def __init__(self, zenoh_port, robot, wanted="hat", hz=5.0, profile=ZED, bid=None, before=None):
        self.robot, self.ticks = robot, 0
        self._wanted, self._said_before = wanted, before or {}
        self.who = []
        """The credentials of those who asked for a bid."""
        self.begin_again()
        self._hz = hz
        self._session = open_client(f"tcp/127.0.0.1:{zenoh_port}")
        key = f"{robot}/{keys.STATUS}"
        self._session.declare_queryable(key, lambda query: query.reply(key, self.status()))
        about = f"{robot}/{keys.CONFIGURATION}"
        text = msgspec.json.encode(NavigatorConfig(robot=robot, profile=profile))
        self._session.declare_queryable(about, lambda query: query.reply(about, text))
        self._served = [] if bid is None else self._serve(bid)
        self._token = self._session.liveliness().declare_token(f"{robot}/{keys.NAVIGATOR_ALIVE}")
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def begin_again(self):
        """Be as at first, with no search taken."""
        self._before = self._said_before
        self.searches = []
        """Searches that it took; without a bid it is a navigator that does not know of bids."""
        self.goal = GoalStatus(goal_id=1, object=self._wanted, outcome="active")

    def _serve(self, bid):
        def answer(_, who):
            self.who.append(who)
            return bid

        session, robot = self._session, self.robot
        return [
            serve_with_credential(session, f"{robot}/{keys.BID}", BidRequest, answer),
            serve(session, f"{robot}/{keys.SEARCH}", SearchRequest, self._search),
            serve(session, f"{robot}/{keys.SENTENCE}", SentenceRequest, self._read),
        ]

    def _search(self, request):
        if request.if_free and self.searches:
            raise RequestRefusedError("it is not free any more: searching")
        self.searches.append(request)
        self._before = {}
        self.goal = GoalStatus(goal_id=2, object=request.object, outcome="active")
        return SearchAccepted(goal_id=2, object=request.object, position=0)

    def _read(self, request):
        read = read_request(request.sentence)
        return as_reading(SentenceAnswer(read, RULES, "", "", ""), 1.0)

    def status(self):
        said = {"goal": self.goal} | self._before
        return encode(status_of(robot=self.robot, frames=self.ticks, **said))

    def close(self):
        self._stop.set()
        self._thread.join(5)
        self._session.close()

    def _run(self):
        while not self._stop.wait(1.0 / self._hz):
            self.ticks += 1
            pose = StampedTransform(
                stamp_ns=self.ticks,
                parent="map",
                child="base_link",
                T_parent_child=base_pose(1.0 + 0.01 * self.ticks, 2.0, 0.0, 0.0),
            )
            self._session.put(f"{self.robot}/{keys.TF}", encode_transforms([pose]))
            self._session.put(f"{self.robot}/{keys.STATUS}", self.status())
