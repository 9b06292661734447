import hashlib
import itertools
import logging
import math
import queue
import signal
import time
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from app.links.network.latched_topic import LatchedReceiver, LatchedTopic
from app.links.network.requests import last_message
from app.links.network.sender import Sender
from app.links.network.session import open_client, open_router
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.control import encode
from app.messages.depth.depth_images import decode_depth
from app.messages.images import decode_camera, decode_color
from app.messages.motion import (
    StampedTwist,
    decode_flag,
    decode_transforms,
    encode_number,
    encode_twist,
)
from app.messages.perception.heatmaps import decode_heatmap
from app.messages.status import SegmentationLabels
from app.nodes import robot_sim
from app.nodes.robot_sim import PHYSICS_HZ, GroundTruth, RobotSim, RobotSimConfig, is_due
from ippon.geometry import yaw_of
from ippon.simulation.homes.generator import generate_home
from ippon.vocabulary import MATTERPORT_40
from tests.app.faulty_search import coasted_s
from tests.app.relay import Relay

pytestmark = pytest.mark.process

COLD_S = 200.0
"""The first robot compiles its kernels, 13 s of a core, beside other tests."""
DECODERS = {
    keys.COLOR: decode_color,
    keys.DEPTH: decode_depth,
    keys.CAMERA_INFO: decode_camera,
    keys.HEATMAP: decode_heatmap,
    keys.CONTACT: decode_flag,
    keys.TF: decode_transforms,
}


class Station:
    """What a navigator is to a robot: labels, ears and commands."""

    def __init__(self, endpoint):
        self.session = open_router(endpoint)
        self.heard = queue.SimpleQueue()
        for topic in DECODERS:
            subscribe(self.session, f"r/{topic}", self._receiver(topic))
        self._sender = Sender()
        self._labels = LatchedTopic(self.session, f"r/{keys.LABELS}", self._sender)
        self.search("hat")
        self.last = {}

    def search(self, ooi):
        self._labels.put(encode(SegmentationLabels(labels=list(MATTERPORT_40), ooi=ooi)))

    def _receiver(self, topic):
        return lambda payload: self.heard.put((topic, payload))

    def wait_for(self, topic, timeout_s=COLD_S):
        """Return the next message of a topic, decoded; the others are kept in `last`."""
        deadline = time.monotonic() + timeout_s
        while True:
            heard, payload = self.heard.get(timeout=max(0.01, deadline - time.monotonic()))
            self.last[heard] = payload
            if heard == topic:
                return DECODERS[topic](payload)

    def close(self):
        self._sender.close()
        self.session.close()

    def pose(self):
        """Return the newest pose of the base and its stamp in seconds."""
        while not self.heard.empty():
            topic, payload = self.heard.get()
            self.last[topic] = payload
        return _base_of(decode_transforms(self.last[keys.TF]))

    def drive(self, linear, yaw_rate=0.0, stamp_ns=0):
        twist = StampedTwist(stamp_ns=stamp_ns, linear_m_s=linear, yaw_rate_rad_s=yaw_rate)
        self.session.put(f"r/{keys.CMD_VEL}", encode_twist(twist))

    def tilt(self, angle):
        self.session.put(f"r/{keys.CMD_TILT}", encode_number(angle))

    def truth(self):
        payload = last_message(self.session, f"r/{keys.SIM_TRUTH}", 10.0)
        return msgspec.json.decode(payload, type=GroundTruth)


def _base_of(transforms):
    base = next(t for t in transforms if t.child == "base_link")
    return base.T_parent_child, base.stamp_ns / 1e9


@pytest.fixture
def station(free_endpoint):
    station = Station(free_endpoint)
    yield station
    if not station.session.is_closed():
        station.close()


@pytest.fixture(scope="module")
def running(launch_shared, shared_endpoint):
    """A robot that runs for the tests that leave it running, and what it talks to."""
    station = Station(shared_endpoint)
    where = ("--connect", shared_endpoint, "--robot", "r", "--home", "3", "--width", "96")
    robot = launch_shared("sim", *where)
    station.wait_for(keys.COLOR)
    yield station, robot
    station.close()


@pytest.fixture
def start_robot(launch, free_endpoint):
    def start(*extra):
        where = ("--connect", free_endpoint, "--robot", "r", "--home", "3", "--width", "96")
        return launch("sim", *where, *extra)

    return start


def test_it_publishes_what_a_ros_2_robot_would(running):
    station, _ = running
    color = station.wait_for(keys.COLOR)
    depth = decode_depth(station.last[keys.DEPTH])
    heatmap = decode_heatmap(station.last[keys.HEATMAP])
    camera = decode_camera(station.last[keys.CAMERA_INFO])
    assert color.stamp_ns == depth.stamp_ns == heatmap.stamp_ns
    assert color.frame_id == camera.frame_id
    assert depth.depth.shape == (camera.camera.height, camera.camera.width) == (60, 96)
    assert 0.3 < np.median(depth.depth[depth.depth > 0]) < 5.0
    assert heatmap.heatmap.labels == MATTERPORT_40
    children = {t.child for t in decode_transforms(station.last[keys.TF])}
    assert children == {"base_link", camera.frame_id}
    stamps = [color.stamp_ns, *(station.wait_for(keys.COLOR).stamp_ns for _ in range(4))]
    assert np.diff(stamps).tolist() == [200_000_000] * 4


TF_PERIOD_S = 0.04


def drive_off(station, speed=0.4):
    """Drive forward for a second; return the pose and the stamp at the last command."""
    for _ in range(20):
        station.drive(speed)
        time.sleep(0.05)
    station.drive(speed)
    return station.pose()


def test_it_stands_half_a_second_after_the_last_command(running):
    station, _ = running
    before, _ = drive_off(station)
    # When the last command comes, the robot begins to turn: its clock times what follows.
    station.drive(0.4, 0.6)
    turns_s, moved_s, stamp_s = math.inf, 0.0, 0.0
    while stamp_s <= moved_s + 1.5 or math.isinf(turns_s):
        # Each pose in turn: one that is skipped would move the time at which the robot stands.
        T, stamp_s = _base_of(station.wait_for(keys.TF))
        if not np.array_equal(T[:3, :3], before[:3, :3]):
            turns_s = min(turns_s, stamp_s)
        if not np.array_equal(T[:3, 3], before[:3, 3]):
            moved_s = stamp_s
        before = T
    assert turns_s < moved_s <= turns_s + 0.5 + 2 * TF_PERIOD_S


def test_a_search_that_begins_while_the_line_is_cut_is_seen(station, free_endpoint):
    relay = Relay(int(free_endpoint.rsplit(":", 1)[1]))
    token = station.session.liveliness().declare_token(f"r/{keys.NAVIGATOR_ALIVE}")
    client = open_client(f"tcp/127.0.0.1:{relay.port}")
    scene = generate_home(3)
    config = RobotSimConfig(robot="r", connect=free_endpoint, image_width=48)
    robot = RobotSim(config, client, scene, scene.start_poses[0])
    robot.await_labels()
    relay.lets_in = False
    relay.cut()
    station.search("mug")
    relay.lets_in = True
    end = time.monotonic() + COLD_S
    while robot._labels.ooi != "mug":
        assert time.monotonic() < end
        time.sleep(0.02)
    client.close()
    token.undeclare()
    relay.close()


def test_it_obeys_within_its_limits(running):
    station, _ = running
    before, t0 = station.pose()
    station.tilt(-0.5)
    turned, end = 0.0, time.monotonic() + COLD_S
    while turned < 0.3 or _tilt_of(station) != pytest.approx(-0.5, abs=1e-6):
        assert time.monotonic() < end, turned
        station.drive(0.0, 100.0)
        time.sleep(0.05)
        after, t1 = station.pose()
        turned = (yaw_of(after) - yaw_of(before)) % (2 * math.pi)
        assert t1 - t0 > 5.0 or turned <= 1.2 * (t1 - t0) + 1e-6


def _tilt_of(station):
    transforms = decode_transforms(station.last[keys.TF])
    camera = next(t for t in transforms if t.child == "camera_color_optical_frame")
    return math.asin(camera.T_parent_child[2, 2])


def test_it_stands_when_the_link_is_gone_and_comes_back_by_itself(
    station, start_robot, free_endpoint
):
    start_robot()
    station.wait_for(keys.COLOR)
    drive_off(station, speed=0.4)
    station.close()
    again = Station(free_endpoint)
    try:
        # The first colour image may belong to a frame whose pose came before the subscription.
        again.wait_for(keys.TF)
        again.wait_for(keys.COLOR)
        # The link may be back before the watchdog has stopped the robot.
        now = again.pose()[0]
        for _ in range(10):
            again.wait_for(keys.COLOR)
            before, now = now, again.pose()[0]
            if np.array_equal(before, now):
                break
        assert np.array_equal(before, now), "it does not stand"
        assert 0.0 < coasted_s(again.truth()) <= 0.5
    finally:
        again.close()


def test_hostile_commands_are_skipped(running):
    station, robot = running
    for payload in (b"", b"\0\1\0\0", b"\xff" * 1000, encode_twist_nan(), bytes(1_000_000)):
        station.session.put(f"r/{keys.CMD_VEL}", payload)
        station.session.put(f"r/{keys.CMD_TILT}", payload)
        station.session.put(f"r/{keys.LABELS}", payload)
    robot.wait_for_log("message skipped")
    station.pose()
    stamp = station.wait_for(keys.COLOR).stamp_ns
    assert station.wait_for(keys.COLOR).stamp_ns > stamp
    assert len(robot.log()) < 20_000


def encode_twist_nan():
    return encode_twist(StampedTwist(stamp_ns=0, linear_m_s=math.nan, yaw_rate_rad_s=0.0))


def lock_step_run(station, frames=12):
    """Answer frames with fixed commands; return a digest of all that the robot sent."""
    digest = hashlib.sha256()
    for k in range(frames):
        color = station.wait_for(keys.COLOR)
        assert color.stamp_ns == k * 200_000_000
        for topic in DECODERS:
            digest.update(station.last[topic])
        # A command of another stamp, as a repeating navigator sends, moves nothing.
        station.drive(0.8, stamp_ns=color.stamp_ns - 1)
        station.tilt(-0.05 * k)
        station.drive(0.2, 0.4, stamp_ns=color.stamp_ns)
    return digest.hexdigest()


def test_lock_step_waits_for_answers_and_repeats_itself(station, start_robot):
    robot = start_robot("--speed", "max")
    first = lock_step_run(station)
    time.sleep(1.0)
    station.wait_for(keys.COLOR)
    assert station.heard.empty(), "no frame without an answer to the one before"
    robot.child.send_signal(signal.SIGTERM)
    assert robot.finish()[0] == 0
    start_robot("--speed", "max")
    assert lock_step_run(station) == first


def test_no_navigator(launch, free_endpoint):
    robot = launch("sim", "--connect", free_endpoint, "--home", "3")
    status, out = robot.finish()
    assert (status, out) == (2, "")
    assert f"no navigator answers at {free_endpoint}" in robot.log()
    assert "Traceback" not in robot.log()


def test_the_robot_waits_for_a_navigator_that_compiles_and_says_so_once(monkeypatch, caplog):
    answers = iter([None, None, None, b"labels"])
    monkeypatch.setattr(robot_sim, "SILENT_WAIT_S", 0.05)
    caplog.set_level(logging.INFO, logger=robot_sim.__name__)
    taken = []
    config = RobotSimConfig(robot="robot-2", connect="tcp/127.0.0.1:7448")
    robot = SimpleNamespace(
        _session=None,
        _key=lambda key: key,
        _config=config,
        _latched=LatchedReceiver(taken.append),
        _last_labels=lambda: next(answers),
    )
    RobotSim.await_labels(robot, 30.0)
    assert taken == [b"labels"]
    (line,) = caplog.messages
    assert line == (
        "waiting for the navigator of robot-2 at tcp/127.0.0.1:7448: at its first start it compiles"
    )


@pytest.mark.parametrize("rate_hz", [0.5, 3.0, 5.0, 7.5, 20.0, 35.0, 50.0])
def test_frames_come_at_the_rate_that_was_asked_for(rate_hz):
    ticks = [tick for tick in range(round(40 * PHYSICS_HZ)) if is_due(tick, rate_hz)]
    assert ticks[0] == 0
    assert len(ticks) == 40 * rate_hz
    apart = {later - one for one, later in itertools.pairwise(ticks)}
    assert max(apart) - min(apart) <= 1
