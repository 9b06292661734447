"""What is published adds up to the map, however slow the link is."""

import dataclasses
import math
import queue
import threading
import time
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.links.network import sender as sender_module
from app.links.network.sender import Sender
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.control import decode
from app.messages.scene import decode_voxels
from app.messages.status import FarEvidenceCells
from app.nodes.navigator import map_publisher as publisher
from app.nodes.navigator.map_publisher import MAX_WAITING, MapPublisher, plan_messages
from ippon.camera import PinholeCamera
from ippon.mission.config import MissionConfig
from ippon.mission.mission import Mission
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld
from ippon.vocabulary import MATTERPORT_40

CAMERA = PinholeCamera.from_horizontal_fov(48, 30, math.radians(74.0))


@pytest.fixture
def sender(monkeypatch):
    # Its thread may have to wait for the machine.
    monkeypatch.setattr(sender_module, "FLUSH_S", 20.0)
    sender = Sender()
    yield sender
    sender.close()


@pytest.fixture
def mission():
    return Mission(MissionConfig(), ZED, MATTERPORT_40, seed=0)


@pytest.fixture
def shown(sessions, mission, sender):
    return MapPublisher(sessions[0], "r", mission.voxel_map, 1e9, sender)


@pytest.fixture
def clouds(sessions, shown):
    """Everything that was published of the map, in the order in which it came."""
    came = queue.SimpleQueue()
    for key in (keys.MAP_VOXELS, keys.MAP_KEYFRAME):
        subscribe(sessions[1], f"r/{key}", lambda p, k=key: came.put((k, decode_voxels(p))))
    # A latched answer tells that the subscriptions have been taken note of.
    list(sessions[1].get(f"r/{keys.PLAN_TREE}", timeout=5.0))
    return came


@pytest.fixture
def steps(mission):
    """Let the mission see a home, while it stands, in frames that look elsewhere each time."""
    scene = generate_home(3)
    world = SimulatedWorld(scene, ZED, CAMERA, scene.start_poses[0], seed=0)
    world.set_labels(MATTERPORT_40, None)

    def step():
        result = mission.step(world.observe())
        command = type(result.command)(yaw_rate_rad_s=1.0, tilt_rad=-0.4)
        world.step(command, 0.4)
        return result.snapshot

    return step


def add_up(clouds, voxel_m):
    voxels = set()
    for cloud in clouds:
        for index, removed in zip(cloud.indices(voxel_m).tolist(), cloud.removed, strict=True):
            (voxels.discard if removed else voxels.add)(tuple(index))
    return voxels


def take(clouds, count):
    return [clouds.get(timeout=10.0) for _ in range(count)]


def test_stamps_grow_with_each_message_also_within_one_frame(shown, clouds, steps, mission):
    snapshot = steps()
    shown.publish(snapshot)
    first = decode_voxels(shown.keyframe())
    mission.observe(mission._last)
    again = decode_voxels(shown.keyframe())
    deltas = [cloud.stamp_ns for _, cloud in take(clouds, 2)]
    assert snapshot.stamp_ns == deltas[0] < first.stamp_ns < deltas[1] < again.stamp_ns


def test_on_a_slow_link_changes_gather_and_nothing_is_lost(
    shown, clouds, steps, sender, mission, monkeypatch
):
    monkeypatch.setattr(publisher, "MAX_BACKLOG_BYTES", 10_000)
    free = threading.Event()
    sender.put(20_000, lambda: free.wait(30.0))
    for _ in range(5):
        shown.publish(steps())
    assert sender.backlog_bytes == 20_000, "not a byte was added to what already waits too long"
    done = threading.Event()
    sender.put(0, done.set)
    free.set()
    assert done.wait(10.0)
    shown.publish(steps())
    ((_, delta),) = take(clouds, 1)
    whole = decode_voxels(shown.keyframe())
    voxel_m = mission.config.map.voxel_size_m
    assert add_up([delta], voxel_m) == add_up([whole], voxel_m) != set()


def test_the_whole_map_is_published_while_somebody_hears_it(sessions, mission, steps, sender):
    shown = MapPublisher(sessions[0], "r", mission.voxel_map, 0.0, sender)
    encoded, keyframe = [], shown.keyframe
    shown.keyframe = lambda: encoded.append(1) or keyframe()
    shown.publish(steps())
    assert encoded == []
    heard = threading.Event()
    subscribe(sessions[1], "r/**", lambda _: heard.set())
    deadline = time.monotonic() + 10.0
    while not encoded:
        assert time.monotonic() < deadline
        shown.publish(steps())
    assert heard.wait(10.0)


def test_requests_for_the_map_wait_while_the_link_is_busy(shown, sender, monkeypatch):
    monkeypatch.setattr(publisher, "MAX_BACKLOG_BYTES", 10_000)
    free, done, replies = threading.Event(), threading.Event(), []
    sender.put(20_000, lambda: free.wait(30.0))
    query = MagicMock()
    query.reply.side_effect = lambda *_: replies.append(1)
    for _ in range(3):
        assert shown.ask(query)
        shown.answer()
    assert sender.backlog_bytes == 20_000, "not a byte was added to what already waits too long"
    sender.put(0, done.set)
    free.set()
    assert done.wait(10.0)
    shown.answer()
    sender.close()
    assert len(replies) == 3


def test_what_images_show_is_told_when_it_changes(steps):
    first = steps()
    told = decode(dict(plan_messages(first, None))[keys.FAR_EVIDENCE], FarEvidenceCells)
    assert told.cells == []
    assert keys.FAR_EVIDENCE not in dict(plan_messages(first, first))
    cells = np.array([[3.125, -1.375, 2.5], [3.375, -1.375, 0.75]], np.float32)
    seen = dataclasses.replace(first, far_evidence=cells, far_evidence_cell_m=0.25)
    told = decode(dict(plan_messages(seen, first))[keys.FAR_EVIDENCE], FarEvidenceCells)
    np.testing.assert_allclose(told.cells, cells, atol=0.006)
    assert (told.cell_m, told.stamp_ns) == (0.25, first.stamp_ns)


def test_what_images_show_is_told_anew_after_the_clock_has(sessions, shown, steps):
    came = queue.SimpleQueue()
    subscribe(
        sessions[1], f"r/{keys.FAR_EVIDENCE}", lambda p: came.put(decode(p, FarEvidenceCells))
    )
    list(sessions[1].get(f"r/{keys.PLAN_TREE}", timeout=5.0))
    first = steps()
    second = 1_000_000_000
    # What waits for the link gives way to what is newer: each is taken before the next is sent.
    for stamp_s, told in ((10, True), (11, False), (12, False), (1, True), (2, True), (3, False)):
        shown.publish(dataclasses.replace(first, stamp_ns=stamp_s * second))
        if told:
            assert came.get(timeout=10.0).stamp_ns == stamp_s * second
    other = np.array([[1.0, 2.0, 3.0]], np.float32)
    shown.publish(dataclasses.replace(first, stamp_ns=4 * second, far_evidence=other))
    assert came.get(timeout=10.0).stamp_ns == 4 * second, "and nothing in between"


def test_all_who_ask_for_the_map_share_one_answer(shown, sessions, steps, monkeypatch):
    shown.publish(steps())
    made = []
    keyframe = shown.keyframe
    monkeypatch.setattr(shown, "keyframe", lambda: made.append(1) or keyframe())
    key, asked = f"r/{keys.MAP_KEYFRAME}", threading.Semaphore(0)

    def ask(query):
        if not shown.ask(query):
            query.drop()
        asked.release()

    queryable = sessions[0].declare_queryable(key, ask)
    gets = [sessions[1].get(key, timeout=10.0) for _ in range(MAX_WAITING + 3)]
    for _ in gets:
        assert asked.acquire(timeout=10.0)
    shown.answer()
    answers = [[r.ok.payload.to_bytes() for r in replies] for replies in gets]
    queryable.undeclare()
    assert sum(len(a) for a in answers) == MAX_WAITING
    assert len({a[0] for a in answers if a}) == len(made) == 1
    assert np.any(~decode_voxels(answers[0][0]).removed)
