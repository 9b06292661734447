"""A process that sends each kind of message as fast as it can beside a search.

The robot must stand within half a second of the operator's Stop, touch nothing meanwhile, and move
again after Resume. Commands to the robot itself are left out: who may send `cmd_vel` drives the
robot, and only certificates prevent that (`test_security_profiles`).
"""

import contextlib
import subprocess
import sys
import threading
import time

import msgspec
import psutil
import pytest

from app.links.network.requests import (
    RequestRefusedError,
    ask,
    ask_until_answered,
    last_message,
)
from app.links.network.session import LinkError, open_client
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.control import ControlReply, ControlRequest, SearchAccepted, SearchRequest
from app.messages.motion import decode_twist
from app.nodes.navigator.services.request_services import ENDPOINTS
from app.nodes.robot_sim import GroundTruth
from tests.app.flooder import Flood
from tests.locations import ROOT
from tests.machine_lateness import MachineLateness

pytestmark = [pytest.mark.process, pytest.mark.slow]

STOP_S = 0.5
"""Within which it stands; without the time in which the machine runs something else."""
ANSWER_S = 1.0
"""Within which a Stop is answered, likewise. The robot stands by then: the answer waits for its
turn among the threads of all keys, at most 0.62 s in eight floods of every request at once."""
SECONDS = 30.0
RECORDED = (
    keys.COLOR, keys.DEPTH, keys.CAMERA_INFO, keys.TF, keys.HEATMAP, keys.CONTACT, keys.STATUS,
    keys.MAP_VOXELS,
)  # fmt: skip
"""Topics that are flooded with a message of the running search."""
GARBAGE = (
    *RECORDED, keys.COLOR_RAW, keys.DEPTH_RAW, keys.TF_STATIC, keys.ODOM, keys.BOXES, keys.MASKS,
    keys.LABEL_NAMES, keys.DETECTOR_NAME, keys.NAVIGATION_STATUS, keys.TELEOP, keys.ENDED,
    keys.CMD_VEL, keys.CMD_TILT, keys.LABELS,
)  # fmt: skip
REQUESTS = {
    keys.SEARCH: {"object": "hat"},
    keys.CONTROL: {"action": "cancel", "goal_id": 99},
    keys.FEEDBACK: {"verdict": "reject"},
    keys.GUIDANCE: {"label": "bed", "level": "far"},
    keys.VOCABULARY: {"label": "lantern"},
    keys.SENTENCE: {"sentence": "find my red keys in the kitchen or in the bathroom"},
    keys.PICTURE: {"jpeg": "/9j/4AAQSkZJRg=="},
    keys.DRIVE: {"mode": "auto"},
    keys.GOTO: {"x_m": 900.0, "y_m": 900.0},
    keys.QUEUE: {"action": "cancel", "goal_id": 99},
    keys.SEARCHES: {"action": "delete", "name": "none"},
    keys.PAINT: {"action": "look_here", "strokes": [[1.0, 1.0]]},
    keys.INSPECT: {},
    keys.PREVIEW: {"levels": {}},
    keys.ROOMS: {},
    keys.ROOM_NAME: {"room": 1, "name": "hall"},
    keys.LEASE: {"action": "renew"},
    keys.LEASE_TAKE: {},
    keys.BID: {"search": {"object": "hat", "context": "it is in the kitchen"}},
}
FETCHED = (keys.STATUS, keys.MAP_KEYFRAME, keys.LEVELS, keys.LABELS, keys.MEMORY)


class Search:
    """A search that drives, with an operator who watches the commands."""

    def __init__(self, endpoint, navigator):
        self.endpoint = endpoint
        self._process = psutil.Process(navigator.child.pid)
        # Who listens to a flood is flooded, too: the watcher hears commands only.
        self._watcher, self._operator = open_client(endpoint, 60.0), open_client(endpoint, 60.0)
        self._twists = []
        self._recorded = {}
        subscribe(self._watcher, f"r/{keys.CMD_VEL}", self._watch)

    def _watch(self, payload):
        with contextlib.suppress(Exception):
            self._twists.append((time.monotonic(), decode_twist(payload)))

    def start(self):
        deadline = time.monotonic() + 120.0
        while last_message(self._operator, f"r/{keys.STATUS}", 1.0) is None:
            assert time.monotonic() < deadline
            time.sleep(0.1)
        request = SearchRequest(object="toilet")
        ask(self._operator, f"r/{keys.SEARCH}", request, SearchAccepted, 20.0)

    def record(self):
        """Keep a message of each topic that is flooded with one."""
        session, complete = open_client(self.endpoint), threading.Event()

        def keep(topic, payload):
            self._recorded[topic] = payload
            if len(self._recorded) == len(RECORDED):
                complete.set()

        for topic in RECORDED:
            subscribe(session, f"r/{topic}", lambda payload, topic=topic: keep(topic, payload))
        assert complete.wait(60.0), sorted(self._recorded)
        session.close()

    def recorded(self, topic):
        return self._recorded[topic]

    def wait_until_moving(self, timeout_s=60.0):
        since = time.monotonic()
        while not any(_moves(t) for at, t in list(self._twists[-5:]) if at > since):
            assert time.monotonic() - since < timeout_s, "it does not drive"
            time.sleep(0.05)

    def truth(self):
        payload = last_message(self._operator, f"r/{keys.SIM_TRUTH}", 10.0)
        return msgspec.json.decode(payload, type=GroundTruth)

    def control(self, action):
        # As `ippon control` and the console do: Stop is sent until it is answered.
        send = ask_until_answered if action == "stop" else ask
        request = ControlRequest(action=action)
        return send(self._operator, f"r/{keys.CONTROL}", request, ControlReply, 10.0).state

    def memory_mb(self):
        return self._process.memory_info().rss / 1e6

    def moved_at(self, since):
        """Return when the last command that moves the base came; `since` if none came later."""
        return max((at for at, t in list(self._twists) if _moves(t) and at > since), default=since)

    def close(self):
        self._watcher.close()
        self._operator.close()


def _moves(twist):
    return twist.linear_m_s != 0.0 or twist.yaw_rate_rad_s != 0.0


@pytest.fixture
def search(launch, free_endpoint):
    navigator = launch("navigate", "--listen", free_endpoint, "--robot", "r")
    search = Search(free_endpoint, navigator)
    search.start()
    where = ("--connect", free_endpoint, "--robot", "r", "--home", "3", "--width", "160")
    launch("sim", *where)
    search.wait_until_moving()
    search.record()
    yield search
    search.close()
    assert "Traceback" not in navigator.log()


def stop_amid(search, flood, path):
    """Flood, stop in the middle of it, and resume after it; return what happened."""
    path.write_bytes(msgspec.json.encode(flood))
    search.wait_until_moving()
    # The robot touches things without a flood, too: where its camera does not look.
    touched = search.truth().collisions
    flooder = subprocess.Popen(
        [sys.executable, "-m", "tests.app.flooder", str(path)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert flooder.stdout.readline() == "floods\n"
        time.sleep(0.4 * flood.seconds)
        with MachineLateness() as lateness:
            asked_at = time.monotonic()
            assert search.control("stop") == "stopped"
            answered_at = time.monotonic()
            out, _ = flooder.communicate(timeout=flood.seconds + 60.0)
    finally:
        flooder.kill()
        flooder.communicate()
    for what, at, limit_s in (
        ("moved", search.moved_at(asked_at), STOP_S),
        ("answered", answered_at, ANSWER_S),
    ):
        assert lateness.net_s(asked_at, at) < limit_s, (what, at - asked_at)
        assert at - asked_at < 10.0 * STOP_S, what
    deadline = time.monotonic() + 20.0
    while search.truth().trajectory[-1] != search.truth().trajectory[-1]:
        assert time.monotonic() < deadline, "it stands"
    assert search.truth().collisions == touched
    _resume(search)
    return int(out)


def _resume(search):
    """Resume; what is left of a flood of requests may refuse the first ones."""
    deadline = time.monotonic() + 10.0
    while True:
        try:
            return search.control("resume")
        except (LinkError, RequestRefusedError):
            if time.monotonic() > deadline:
                raise
        time.sleep(0.2)


def _puts(search, topics):
    return [(f"r/{topic}", search.recorded(topic)) for topic in topics]


def _queries(topics):
    return [(f"r/{topic}", msgspec.json.encode(REQUESTS.get(topic, {}))) for topic in topics]


GARBLED = b"\0\1\0\0" + b"\xff" * 500


def test_every_request_is_flooded():
    served = {endpoint.key for endpoint in ENDPOINTS}
    assert served == set(REQUESTS)


def test_stop_arrives_amid_floods(search, tmp_path, free_endpoint):
    for puts, queries in (
        (_puts(search, RECORDED), []),
        ([(f"r/{topic}", GARBLED) for topic in GARBAGE], []),
        ([], _queries((*REQUESTS, *FETCHED))),
    ):
        flood = Flood(endpoint=free_endpoint, seconds=1.0, puts=puts, queries=queries)
        sent = stop_amid(search, flood, tmp_path / "flood")
        assert sent > 100


KINDS = (
    *RECORDED,
    *(f"{topic}, garbled" for topic in GARBAGE),
    *(f"{topic}?" for topic in (*REQUESTS, *FETCHED)),
)


@pytest.mark.large
@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_message_for_thirty_seconds(search, tmp_path, free_endpoint, kind):
    puts, queries = [], []
    if kind.endswith("?"):
        queries = _queries([kind[:-1]])
    elif kind.endswith(", garbled"):
        puts = [(f"r/{kind.split(',')[0]}", GARBLED)]
    else:
        puts = _puts(search, [kind])
    before_mb = search.memory_mb()
    flood = Flood(endpoint=free_endpoint, seconds=SECONDS, puts=puts, queries=queries)
    sent = stop_amid(search, flood, tmp_path / "flood")
    grown_mb = search.memory_mb() - before_mb
    assert grown_mb < 150.0, f"{grown_mb:.0f} MB more after {sent / SECONDS:.0f} messages a second"
