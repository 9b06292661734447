"""What the navigator says of a robot whose messages are not as they should be; in one process."""

import math
import threading
import time

import numpy as np
import pytest

from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.control import ControlRequest, SearchRequest, decode, encode
from app.messages.images import encode_camera, encode_color, encode_depth
from app.messages.motion import StampedTransform, encode_transforms
from app.messages.perception.detections import encode_detections
from app.messages.perception.detector_info import encode_detector_name, encode_label_names
from app.messages.perception.heatmaps import encode_heatmap
from app.messages.status import Event, Status
from app.nodes.navigator import profile_check
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.node import Navigator
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose
from ippon.observation import Detections, Instance
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld
from ippon.vocabulary import MATTERPORT_40

CAMERA = PinholeCamera.from_horizontal_fov(48, 30, math.radians(74.0))
PERIOD_NS = 100_000_000


class Robot:
    """Stands still and publishes what it sees, ten times a second."""

    def __init__(self, session):
        self._session = session
        scene = generate_home(3)
        world = SimulatedWorld(scene, ZED, CAMERA, scene.start_poses[0], seed=0)
        world.set_labels(MATTERPORT_40, "hat")
        self._frame = world.observe()
        assert self._frame.heatmap is not None
        self._heatmap = self._frame.heatmap
        self._stamp_ns = 0
        self.statuses = []
        self.events = []
        subscribe(session, f"r/{keys.STATUS}", lambda p: self.statuses.append(decode(p, Status)))
        subscribe(session, f"r/{keys.EVENT}", lambda p: self.events.append(decode(p, Event)))

    def send(self, *, jump_m=0.0, heatmap=True, lift_m=0.0, detector=None, stamp_off_ns=0):
        frame, optical = self._frame, "optical"
        stamp = self._stamp_ns = self._stamp_ns + PERIOD_NS
        base = frame.T_world_base @ base_pose(jump_m, 0.0, 0.0, 0.0)
        mount = np.linalg.inv(frame.T_world_base) @ frame.T_world_camera
        mount[2, 3] += lift_m
        transforms = [
            StampedTransform(stamp_ns=stamp, parent="map", child="base_link", T_parent_child=base),
            StampedTransform(
                stamp_ns=stamp, parent="base_link", child=optical, T_parent_child=mount
            ),
        ]
        put = self._session.put
        put(f"r/{keys.TF}", encode_transforms(transforms))
        put(f"r/{keys.CAMERA_INFO}", encode_camera(CAMERA, stamp, optical))
        if heatmap:
            self.send_heatmap(stamp)
        if detector is not None:
            put(f"r/{keys.BOXES}", encode_detections(detector, stamp + stamp_off_ns, optical))
        put(f"r/{keys.DEPTH}", encode_depth(frame.depth, stamp, optical))
        put(f"r/{keys.COLOR}", encode_color(frame.color, stamp, optical))

    def send_heatmap(self, stamp_ns):
        message = encode_heatmap(self._heatmap, stamp_ns, "optical")
        self._session.put(f"r/{keys.HEATMAP}", message)

    def send_until(self, test, timeout_s=30.0, **how):
        """Publish until a status passes a test; returns that status."""
        self.statuses.clear()
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            self.send(**how)
            time.sleep(0.1)
            for status in list(self.statuses):
                if test(status):
                    return status
        raise AssertionError([(s.state, s.why, s.notes) for s in self.statuses[-3:]])


def wait_until(condition, timeout_s=120.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture
def robot(sessions):
    router, client = sessions
    robot = Robot(client)
    config = NavigatorConfig(robot="r", heatmap_lost_s=0.5)
    navigator, stop = Navigator(config, router), threading.Event()
    thread = threading.Thread(target=navigator.run, args=(stop,))
    thread.start()
    list(client.get(f"r/{keys.SEARCH}", payload=encode(SearchRequest(object="hat")), timeout=10.0))
    robot.send_until(lambda s: s.frames > 3 and s.state != "lost", 120.0)
    robot.navigator = navigator
    yield robot
    stop.set()
    thread.join()
    navigator.close()


def test_refused_frames_are_shown_until_one_is_accepted(robot):
    rejected = {s.name: s.rejected for s in robot.statuses[-1].streams}
    # It goes on jumping, farther than any speed makes up for.
    jump = 50.0
    status = robot.send_until(lambda s: s.state == "lost", jump_m=jump)
    assert status.why.startswith("frames are refused: the camera jumped 50")
    after = {s.name: s.rejected for s in status.streams}
    assert after["pose"] > rejected["pose"]
    assert after["depth"] == rejected["depth"]
    assert robot.send_until(lambda s: s.state != "lost").state == "looking_around"


def test_a_segmentation_that_stops_is_reported_and_the_search_goes_on(robot):
    status = robot.send_until(lambda s: bool(s.notes), heatmap=False)
    assert status.notes == ["no heatmap: objects are not recognised; the search continues"]
    assert status.state == "looking_around"
    assert robot.send_until(lambda s: not s.notes).goal.outcome == "active"
    told = [(e.kind, e.text[:10]) for e in robot.events if "heatmap" in e.text]
    assert told == [("stream_lost", "no heatmap"), ("stream_back", "heatmap is")]


def test_a_heatmap_that_comes_late_counts_once_and_its_depth_not_again(robot):
    frames = robot.send_until(lambda s: bool(s.notes), heatmap=False).frames
    robot.send_until(lambda s: s.frames > frames + 3, heatmap=False)
    # Silent for so long, it has no frame that waits.
    wait_until(lambda: robot.statuses[-1].state == "lost")
    voxel_map = robot.navigator._mission.voxel_map
    revision, weight = voxel_map.revision, voxel_map._pools.weight.copy()
    labels, odds = voxel_map.surface.energy.copy(), voxel_map.surface.log_odds.copy()
    for stamp_ns in sorted(robot.navigator._intake.assembler._without)[-2:]:
        robot.send_heatmap(stamp_ns)
    wait_until(lambda: voxel_map.revision == revision + 2)
    assert (voxel_map.surface.energy != labels).any()
    assert (voxel_map.surface.log_odds != odds).any()
    assert (voxel_map._pools.weight == weight).all()


def test_a_robot_that_is_not_what_its_profile_says_is_told_and_forgiven(robot, monkeypatch):
    monkeypatch.setattr(profile_check, "CHECK_EVERY_S", 0.5)
    status = robot.send_until(lambda s: bool(s.notes), lift_m=0.5)
    (note,) = status.notes
    assert note.startswith("robot profile: by tf the camera is 1.70 m above the base, the profile")
    robot.send_until(lambda s: s.frames > status.frames + 12, lift_m=0.5)
    told = [e.kind for e in robot.events if "above the base" in e.text]
    assert told == ["error"], "once, however long it lasts"
    assert robot.send_until(lambda s: not s.notes).goal.outcome == "active"


def seen_on_the_wall(label="hat"):
    h, w = CAMERA.height, CAMERA.width
    # Where the view shows one surface, 2.5 m away.
    box = (23.0, 8.0, 30.0, 22.0)
    return Detections(
        source="x", labels=(label,), ooi=None, image_size=(h, w),
        instances=(Instance(label=label, score=0.9, box_px=box),),
    )  # fmt: skip


def test_a_detector_on_the_robot_makes_the_map_believe(robot):
    voxel_map = robot.navigator._mission.voxel_map
    for key, request in (
        (keys.SEARCH, SearchRequest(object="crown")),
        (keys.CONTROL, ControlRequest(action="cancel")),
    ):
        list(robot._session.get(f"r/{key}", payload=encode(request), timeout=10.0))
    robot.send_until(lambda _: voxel_map.ooi == "crown", heatmap=False)
    assert voxel_map.best_ooi() < 0.5
    crown = seen_on_the_wall("crown")
    robot.send_until(lambda _: voxel_map.best_ooi() > 0.9, heatmap=False, detector=crown)


def test_a_detector_that_cannot_tell_the_object_says_what_it_can(robot):
    robot._session.put(f"r/{keys.DETECTOR_NAME}", encode_detector_name("yolo11n", 0))
    robot._session.put(f"r/{keys.LABEL_NAMES}", encode_label_names(["cup", "chair"], 0))
    status = robot.send_until(
        lambda s: any("is none of them" in note for note in s.notes),
        heatmap=False, detector=seen_on_the_wall(),
    )  # fmt: skip
    note = next(note for note in status.notes if "is none of them" in note)
    assert note.startswith("this detector knows 2 kinds of thing and 'hat' is none of them")
    assert "it knows: cup, chair" in note


def test_a_detector_that_stamps_its_messages_itself_is_told(robot):
    robot.send_until(
        lambda s: any("no image has the stamp" in note for note in s.notes),
        heatmap=False, detector=seen_on_the_wall(), stamp_off_ns=50_000_000,
    )  # fmt: skip
    robot.send_until(lambda s: not s.notes, heatmap=False, detector=seen_on_the_wall())


def test_a_detector_that_dies_is_reported_and_the_search_goes_on(robot):
    robot.send_until(lambda s: s.frames > 6, heatmap=False, detector=seen_on_the_wall())
    status = robot.send_until(
        lambda s: any("objects are not recognised" in note for note in s.notes), heatmap=False
    )
    assert status.state != "lost"
    robot.send_until(lambda s: not s.notes, heatmap=False, detector=seen_on_the_wall())
