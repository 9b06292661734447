"""Poses of a camera that knows none, as the navigator gets them from its messages."""

import dataclasses
import threading
import time

import numpy as np
import pytest
import zenoh

from app.messages import keys
from app.messages.depth.depth_images import encode_depth
from app.messages.images import encode_camera, encode_color
from app.messages.motion import StampedTransform, encode_transforms
from app.nodes.navigator.frame_intake import FrameIntake
from app.nodes.navigator.localization.pose_tracker import LOST_TEXT, PoseTracker, pose_tracker
from app.robot_file import read_profile
from ippon.camera import PinholeCamera
from ippon.simulation.camera.renderer import SceneRenderer
from ippon.tracking.hand_held import HandHeldCamera
from tests.boxes import boxes_scene
from tests.ippon.tracking.conftest import ROOM, held_pose

CAMERA = PinholeCamera.from_horizontal_fov(320, 240, 1.2)
FRAME = "camera_color_optical_frame"


class Events:
    def __init__(self):
        self.reported = []

    def report(self, kind, text, goal_id=None):
        self.reported.append((kind, text))


class Hand:
    """A hand-held camera that sends images, a navigator's intake, and its tracker."""

    def __init__(self, session, offset_s=0.0):
        self.intake = FrameIntake(session, "held", lambda _: None, None, offset_s)
        self.events = Events()
        self.profile = read_profile("hand-held")
        self.tracker = PoseTracker(
            session, "held", self.profile, self.intake, self.events, offset_s
        )
        self._renderer = SceneRenderer(boxes_scene(ROOM))
        self._stamp_ns = 10**12

    def send(self, k, *, covered=False):
        """Send frame k and return it as the intake gives it, with its pose; None for none."""
        self._stamp_ns += 10**8
        image = self._renderer.render(CAMERA, held_pose(k))
        depth = np.zeros_like(image.depth) if covered else image.depth
        self.intake.inject(keys.CAMERA_INFO, encode_camera(CAMERA, self._stamp_ns, FRAME))
        self.intake.inject(keys.DEPTH, encode_depth(depth, self._stamp_ns, FRAME))
        self.intake.inject(keys.COLOR, encode_color(image.color, self._stamp_ns, FRAME))
        deadline = time.monotonic() + 20.0
        frame = None
        while frame is None and time.monotonic() < deadline:
            frame = self.intake.take(0.05)
            if covered and self.tracker.problem:
                break
        self.tracker.check()
        return frame


@pytest.fixture
def offset_s():
    return 0.0


@pytest.fixture
def hand(offset_s):
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", "[]")
    session = zenoh.open(config)
    hand = Hand(session, offset_s)
    yield hand
    hand.tracker.close()
    session.close()


@pytest.mark.slow
def test_images_alone_give_frames_with_the_base_on_the_floor_behind_the_camera(hand):
    sent = []
    hand.tracker._put = lambda _, attachment: sent.append(attachment)
    frames = [hand.send(k) for k in range(6)]
    assert set(sent) == {keys.COMPUTED}
    assert all(frame is not None for frame in frames)
    last = frames[-1]
    assert abs(last.T_world_base[2, 3]) < 1e-9
    assert last.T_world_camera[2, 3] == pytest.approx(held_pose(5)[2, 3], abs=0.04)
    away = last.T_world_camera[:2, 3] - last.T_world_base[:2, 3]
    assert np.linalg.norm(away) == pytest.approx(hand.profile.camera_forward_m)
    moved = np.linalg.norm(last.T_world_camera[:3, 3] - frames[0].T_world_camera[:3, 3])
    true = np.linalg.norm(held_pose(5)[:3, 3] - held_pose(0)[:3, 3])
    assert moved == pytest.approx(true, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("offset_s", [0.04, -0.08])
def test_a_pose_is_that_of_its_image_whatever_the_clock_offset(hand):
    tracked, track = [], HandHeldCamera.track

    def note(camera, *images):
        tracked.append(track(camera, *images))
        return tracked[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(HandHeldCamera, "track", note)
        for k in range(3):
            frame = hand.send(k)
            assert frame is not None, "not one image later"
            assert np.allclose(frame.T_world_camera, tracked[-1].T_world_camera, atol=1e-9)


@pytest.mark.slow
def test_a_lost_camera_is_said_and_found_again(hand):
    for k in range(4):
        hand.send(k)
    assert hand.send(4, covered=True) is None
    assert hand.tracker.problem == LOST_TEXT
    assert hand.events.reported == [("stream_lost", LOST_TEXT)]
    assert hand.send(2) is not None
    assert hand.events.reported[-1] == ("stream_back", "the camera knows its place again")


def test_before_the_floor_was_in_view_it_says_how_to_hold_the_camera(hand):
    assert hand.send(0, covered=True) is None
    assert hand.tracker.problem.startswith("no floor is in view, from which to begin")
    assert hand.events.reported == []


def test_a_robot_that_sends_its_pose_is_not_tracked(hand):
    hand.intake.has_tf = True
    pose = StampedTransform(stamp_ns=1, parent="map", child=FRAME, T_parent_child=np.eye(4))
    hand.intake.inject(keys.TF, encode_transforms([pose]))
    hand.intake.inject(keys.CAMERA_INFO, encode_camera(CAMERA, 1, FRAME))
    assert threading.active_count() > 1
    assert hand.tracker.problem == ""
    assert hand.tracker._held is None


def test_only_profiles_that_ask_for_it_are_tracked():
    config = dataclasses.make_dataclass("Config", ["profile"])(read_profile("zed"))
    assert pose_tracker(None, config, None, None) is None
