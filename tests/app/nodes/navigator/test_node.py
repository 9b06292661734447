"""The navigator as a process, with the simulated robot as another."""

import queue
import signal
import statistics
import time

import msgspec
import pytest

from app.links.network.requests import RequestRefusedError, ask, last_message
from app.links.network.session import open_client
from app.links.network.subscription import on_token, subscribe
from app.messages import keys
from app.messages.control import (
    Accepted,
    ControlReply,
    ControlRequest,
    FeedbackRequest,
    GuidanceRequest,
    SearchAccepted,
    SearchRequest,
    decode,
)
from app.messages.motion import decode_path, decode_transforms, decode_twist
from app.messages.scene import decode_found_objects, decode_tree, decode_voxels
from app.messages.status import Event, LevelTable, Status
from app.nodes.robot_sim import PHYSICS_HZ, GroundTruth
from tests.app.faulty_search import STILL, coasted_s

pytestmark = pytest.mark.process

MINUTES_S = 240.0
STAND_S = 0.5


class Operator:
    """A client that sees everything the navigator publishes."""

    def __init__(self, endpoint):
        self.session = open_client(endpoint, 120.0)
        self.statuses = queue.SimpleQueue()
        self.events = []
        self.voxels = []
        self.whole = None
        """The map as it was when the line was last opened; later changes are in `voxels`."""
        self._broken = True
        self.twists = []
        self.poses = []
        hear = self._hear
        hear(keys.STATUS, lambda p: self.statuses.put(decode(p, Status)))
        hear(keys.EVENT, lambda p: self.events.append(decode(p, Event)))
        hear(keys.MAP_VOXELS, lambda p: self.voxels.append(decode_voxels(p)))
        hear(keys.CMD_VEL, lambda p: self.twists.append((time.monotonic(), decode_twist(p))))
        hear(keys.TF, lambda p: self.poses.append((time.monotonic(), decode_transforms(p)[0])))
        on_token(self.session, f"r/{keys.NAVIGATOR_ALIVE}", lost=self._note_break)

    def _note_break(self):
        self._broken = True

    def follow_map(self):
        """Fetch the whole map if changes may have been missed, as a console does."""
        if self._broken:
            self._broken = False
            self.whole = decode_voxels(self.last(keys.MAP_KEYFRAME))

    def _hear(self, topic, take):
        subscribe(self.session, f"r/{topic}", take)

    def ready(self):
        deadline = time.monotonic() + 180.0
        while last_message(self.session, f"r/{keys.STATUS}", 1.0) is None:
            assert time.monotonic() < deadline
            time.sleep(0.1)

    def search(self, wanted, context=""):
        request = SearchRequest(object=wanted, context=context)
        return self.ask(keys.SEARCH, request, SearchAccepted)

    def ask(self, topic, request, kind, timeout_s=20.0):
        return ask(self.session, f"r/{topic}", request, kind, timeout_s)

    def last(self, topic):
        # What is published for the first time is known here a moment later than it is announced.
        deadline = time.monotonic() + 20.0
        while (payload := last_message(self.session, f"r/{topic}", 20.0)) is None:
            assert time.monotonic() < deadline, f"nobody has anything on {topic}"
            time.sleep(0.1)
        return payload

    def wait_for(self, test, timeout_s=MINUTES_S, follow_map=False):
        """Return the first status from now on that passes a test."""
        deadline = time.monotonic() + timeout_s
        while not self.statuses.empty():
            self.statuses.get()
        while True:
            status = self.statuses.get(timeout=max(0.01, deadline - time.monotonic()))
            if follow_map:
                self.follow_map()
            if test(status):
                return status

    def wait_for_state(self, *states, timeout_s=MINUTES_S):
        return self.wait_for(lambda s: s.state in states, timeout_s)

    def wait_until_moving(self):
        return self.wait_for(lambda _: any(t.linear_m_s > 0.2 for _, t in self.twists[-5:]))


@pytest.fixture
def navigator(launch, free_endpoint):
    return launch("navigate", "--listen", free_endpoint, "--robot", "r")


@pytest.fixture
def operator(navigator, free_endpoint):
    operator = Operator(free_endpoint)
    operator.ready()
    yield operator
    operator.session.close()


@pytest.fixture(scope="module")
def idle(launch_shared, shared_endpoint):
    """A navigator without a goal, for the tests that leave it so, and its operator."""
    process = launch_shared("navigate", "--listen", shared_endpoint, "--robot", "r")
    operator = Operator(shared_endpoint)
    operator.ready()
    yield operator, process
    operator.session.close()


@pytest.fixture
def start_robot(launch, free_endpoint):
    def start(home="3", start="0", speed="1"):
        where = ("--connect", free_endpoint, "--robot", "r", "--home", home, "--start", start)
        return launch("sim", *where, "--width", "240", "--speed", speed)

    return start


def _wants(status, name):
    return status.goal is not None and status.goal.object == name


def _voxels(cloud):
    return {tuple(index) for index in cloud.indices(0.1).tolist()}


@pytest.mark.slow
def test_a_search_from_the_query_to_the_find_and_on(operator, start_robot, navigator):
    accepted = operator.search("couch", "it is in the living room")
    assert (accepted.goal_id, accepted.object, accepted.position) == (1, "sofa", 0)
    table = decode(operator.last(keys.LEVELS), LevelTable)
    assert (table.object, table.goal_id, len(table.rows)) == ("sofa", 1, 40)
    assert operator.search("bed").position == 1

    operator.follow_map()
    # The sofa is near, and the bed in another room.
    start_robot("8", "1", "max")
    # The queued goal starts by itself, on the same map.
    status = operator.wait_for(lambda s: _wants(s, "bed"), follow_map=True)
    assert [(goal.object, goal.outcome) for goal in status.history] == [("sofa", "found")]
    assert status.surface_voxels > 1000
    status = operator.wait_for(lambda s: s.state == "found", follow_map=True)
    assert status.find is not None
    assert status.find.object == "bed"
    assert status.timings.step_ms > 0.0
    # Events have a topic of their own, and may come after the status.
    operator.wait_for(lambda _: sum(e.kind == "found" for e in operator.events) >= 2)
    assert [e.kind for e in operator.events].count("found") == 2

    # What is shown agrees with itself: deltas add up to the keyframe.
    keyframe = decode_voxels(operator.last(keys.MAP_KEYFRAME))
    operator.wait_for(lambda s: s.stamp_ns > keyframe.stamp_ns)
    shown = _voxels(operator.whole)
    for cloud in operator.voxels:
        if operator.whole.stamp_ns < cloud.stamp_ns <= keyframe.stamp_ns:
            gone = cloud.removed.tolist()
            for index, removed in zip(cloud.indices(0.1).tolist(), gone, strict=True):
                (shown.discard if removed else shown.add)(tuple(index))
    left, missing = shown - _voxels(keyframe), _voxels(keyframe) - shown
    assert (len(left), len(missing)) == (0, 0)
    _, tree = decode_tree(operator.last(keys.PLAN_TREE))
    assert len(tree.parents) > 10
    assert decode_path(operator.last(keys.PLAN_PATH)).stamp_ns > 0
    assert decode_found_objects(operator.last(keys.DETECTIONS))[1]

    # A rejected find: it goes on with the same goal.
    assert operator.ask(keys.FEEDBACK, FeedbackRequest(verdict="reject"), Accepted)
    status = operator.wait_for(lambda s: s.goal is not None and s.goal.outcome == "active")
    assert status.goal.object == "bed"
    navigator.child.send_signal(signal.SIGTERM)
    assert navigator.finish()[0] == 0


def _stops_and_resumes_and_takes_requests(operator):
    durations = []
    for level in ("far", "near") * 10:
        started = time.monotonic()
        operator.ask(keys.GUIDANCE, GuidanceRequest(label="bed", level=level), Accepted)
        durations.append(time.monotonic() - started)
        time.sleep(0.03)
    assert statistics.median(durations) < 0.25

    stopped_at = time.monotonic()
    reply = operator.ask(keys.CONTROL, ControlRequest(action="stop"), ControlReply)
    answered_at = time.monotonic()
    assert reply.state == "stopped"
    assert answered_at - stopped_at < 2.0
    # The robot brakes, and its poses come late where it has little time to run.
    poses = lambda: [t for at, t in operator.poses if at > answered_at + 1.2]  # noqa: E731
    operator.wait_for(lambda _: len(poses()) >= 10)
    late = [t for at, t in operator.twists if at > answered_at + 0.05]
    assert late, "a stopped robot still hears commands"
    assert all(t.linear_m_s == 0.0 and t.yaw_rate_rad_s == 0.0 for t in late)
    assert len({tuple(t.T_parent_child[:3, 3]) for t in poses()[-5:]}) == 1
    assert operator.wait_for(lambda _: True).state == "stopped"

    operator.ask(keys.CONTROL, ControlRequest(action="resume"), ControlReply)
    operator.wait_until_moving()
    operator.ask(keys.CONTROL, ControlRequest(action="cancel"), ControlReply)
    status = operator.wait_for(lambda s: s.goal is None)
    assert status.history[-1].outcome == "cancelled"


def _way_since_the_kill_m(truth):
    """Return the way since the last command before the longest time without one, metres."""
    speeds = truth.speeds
    moved = next(k for k, (v, w, _) in enumerate(speeds) if abs(v) > STILL or abs(w) > STILL)
    gap_end = max(range(moved, len(speeds)), key=lambda k: speeds[k][2])
    followed = gap_end - round(speeds[gap_end][2] * PHYSICS_HZ)
    return sum(abs(v) for v, _, _ in speeds[max(followed, 0) :]) / PHYSICS_HZ


def test_a_killed_navigator_leaves_a_standing_robot_and_its_successor_finds_it(
    operator, start_robot, navigator, launch, free_endpoint
):
    operator.search("toilet")
    start_robot()
    operator.wait_until_moving()
    navigator.child.kill()
    operator.session.close()
    successor = launch("navigate", "--listen", free_endpoint, "--robot", "r")
    again = Operator(free_endpoint)
    try:
        successor.wait_for_log("navigator ready")
        status = again.wait_for(lambda s: s.frames > 3, 60.0)
        assert status.goal is None
        truth = msgspec.json.decode(again.last(keys.SIM_TRUTH), type=GroundTruth)
        # As the robot knows it: where the machine is busy, its poses come late.
        assert coasted_s(truth) <= STAND_S
        assert _way_since_the_kill_m(truth) < 0.8 * 0.58
    finally:
        again.session.close()


def test_a_robot_that_falls_silent_and_comes_back_and_is_stopped_and_resumed(operator, start_robot):
    operator.search("toilet")
    robot = start_robot()
    operator.wait_until_moving()
    _falls_silent_and_comes_back(operator, robot)
    operator.wait_until_moving()
    _stops_and_resumes_and_takes_requests(operator)


def _falls_silent_and_comes_back(operator, robot):
    # On a busy machine its images may have been late before.
    told = len(operator.events)
    robot.child.send_signal(signal.SIGSTOP)
    frozen_at = time.monotonic()
    # Colour and depth of an image come one after the other, and may be frozen between.
    operator.wait_for(lambda s: s.state == "lost" and "colour" in s.why, timeout_s=20.0)
    assert time.monotonic() - frozen_at < 15.0
    assert operator.twists[-1][1].linear_m_s == 0.0
    robot.child.send_signal(signal.SIGCONT)
    operator.wait_for(lambda s: s.state != "lost", timeout_s=60.0)
    # Events have a topic of their own, and may come after the status.
    operator.wait_for(lambda _: any(e.kind == "stream_back" for e in operator.events[told:]))
    kinds = [event.kind for event in operator.events[told:]]
    # They may be late once more where its link has to be opened again.
    kinds = kinds[: kinds.index("stream_back") + 1]
    assert kinds.count("stream_lost") == 1


def test_malformed_requests_get_an_answer(idle):
    session = idle[0].session
    for topic in (keys.SEARCH, keys.CONTROL, keys.GUIDANCE, keys.FEEDBACK):
        for payload in (None, b"", b"{", b"\xff\xfe", b'{"surprise": 1}', b"[" * 5000):
            replies = list(session.get(f"r/{topic}", payload=payload, timeout=20.0))
            assert len(replies) == 1
            assert msgspec.json.decode(replies[0].ok.payload.to_bytes())["error"]


def test_requests_out_of_place_are_refused(idle):
    for topic, request, kind, text in (
        (keys.CONTROL, ControlRequest(action="cancel"), ControlReply, "no goal to cancel"),
        (keys.FEEDBACK, FeedbackRequest(verdict="confirm"), Accepted, "there is no find"),
        (keys.GUIDANCE, GuidanceRequest(label="bed", level="far"), Accepted, "there is no goal"),
    ):
        with pytest.raises(RequestRefusedError, match=text):
            idle[0].ask(topic, request, kind)


def test_a_taken_endpoint(idle, launch, shared_endpoint):
    second = launch("navigate", "--listen", shared_endpoint, "--robot", "r")
    status, out = second.finish(120.0)
    assert (status, out) == (2, "")
    assert f"cannot listen on {shared_endpoint}: another navigator may be running" in second.log()
    assert idle[0].last(keys.STATUS) is not None


def test_hostile_messages_are_counted_and_nothing_else(idle, launch, shared_endpoint):
    operator, navigator = idle
    launch("sim", "--connect", shared_endpoint, "--robot", "r", "--home", "3", "--width", "240")
    operator.wait_for(lambda s: s.frames > 3)
    status = None
    while status is None or sum(t.rejected for t in status.streams) < 20:
        # Again and again: of what waits too long, the navigator keeps only the newest.
        for topic in keys.ROS_TYPES:
            for payload in (b"", b"\0\1\0\0", b"\xff" * 500, bytes(200_000)):
                operator.session.put(f"r/{topic}", payload)
        sent_at = time.monotonic()
        status = operator.wait_for(lambda _, since=sent_at: time.monotonic() > since + 1.0)
    assert {t.name for t in status.streams if t.rejected} >= {"colour", "depth", "pose"}
    frames = status.frames
    operator.wait_for(lambda s: s.frames > frames + 3 and s.state != "lost")
    assert sum(e.kind == "bad_message" for e in operator.events) <= len(status.streams)
    assert "Traceback" not in navigator.log()
