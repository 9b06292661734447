import dataclasses
import time

import numpy as np
import pytest

from app.messages import keys
from app.messages.depth.depth_images import encode_depth, encode_depth_raw
from app.messages.images import encode_camera, encode_color
from app.messages.motion import StampedTransform, decode_transforms, encode_transforms
from app.nodes.navigator import stream_conversion
from app.nodes.navigator.frame_intake import FrameIntake
from app.nodes.navigator.stream_conversion import StreamConverter
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose, make_transform
from ippon.robot import ZED
from tests.app.messages.robot_messages import odometry, raw_color

CAMERA = PinholeCamera.from_horizontal_fov(16, 10, 1.2)
FIXED = dataclasses.replace(ZED, min_tilt_rad=-0.2, max_tilt_rad=-0.2)
PERIOD = 200_000_000


@pytest.fixture
def events():
    return []


@pytest.fixture
def make(sessions, events):
    made = []

    def start(profile=FIXED):
        intake = FrameIntake(sessions[0], "r", events.append)
        streams = StreamConverter(sessions[0], "r", profile, intake)
        made.append(streams)
        return intake, streams

    yield start
    for streams in made:
        streams.close()


@pytest.fixture
def impatient(monkeypatch):
    """Uncompressed images are asked for after a third of a second without others."""
    monkeypatch.setattr(stream_conversion, "SILENT_S", 0.3)


def take(intake, streams, timeout_s=8.0):
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        streams.check()
        frame = intake.take(0.05)
        if frame is not None:
            return frame
    return None


def send(robot, stamp_ns, color=None, child="base_link"):
    robot.put(f"r/{keys.CAMERA_INFO}", encode_camera(CAMERA, stamp_ns, "optical"))
    robot.put(f"r/{keys.ODOM}", odometry(stamp_ns, 1.5, 0.5, 0.3, child))
    depth = np.ones((10, 16), np.float32)
    robot.put(f"r/{keys.DEPTH}", encode_depth(depth, stamp_ns, "optical"))
    pixels = np.full((10, 16, 3), (200, 100, 50), np.uint8) if color is None else color
    robot.put(f"r/{keys.COLOR_RAW}", raw_color(pixels, stamp_ns))


@pytest.mark.usefixtures("impatient")
def test_odometry_is_converted_again_and_again_until_the_robot_sends_tf(make, sessions):
    _, robot = sessions
    intake, streams = make()
    frames, stamp, deadline = 0, PERIOD, time.monotonic() + 20.0
    while frames < 4 and time.monotonic() < deadline:
        send(robot, stamp)
        stamp += PERIOD
        frames += take(intake, streams, 0.2) is not None
    assert frames == 4
    assert not intake.has_tf


@pytest.mark.usefixtures("impatient")
def test_raw_images_and_odometry_make_frames_and_go_to_the_others(make, sessions):
    heard = {}
    _, robot = sessions
    subscribers = [
        robot.declare_subscriber(f"r/{topic}", lambda s, t=topic: heard.setdefault(t, s))
        for topic in (keys.COLOR, keys.TF)
    ]
    intake, streams = make()
    deadline = time.monotonic() + 15.0
    frame, stamp = None, PERIOD
    while frame is None and time.monotonic() < deadline:
        send(robot, stamp)
        stamp += PERIOD
        frame = take(intake, streams, 0.2)
    assert frame is not None
    np.testing.assert_allclose(frame.T_world_base, base_pose(1.5, 0.5, 0.0, 0.3), atol=1e-9)
    np.testing.assert_allclose(
        frame.T_world_camera, frame.T_world_base @ FIXED.T_base_camera(-0.2), atol=1e-9
    )
    assert frame.tilt_rad == pytest.approx(-0.2)
    assert np.abs(frame.color.astype(int) - (200, 100, 50)).max() <= 3
    while heard.keys() != {keys.COLOR, keys.TF} and time.monotonic() < deadline:
        time.sleep(0.01)
    names = {(t.parent, t.child) for t in decode_transforms(heard[keys.TF].payload.to_bytes())}
    assert names == {("map", "base_link"), ("base_link", "optical")}
    assert heard[keys.TF].attachment.to_bytes() == keys.COMPUTED
    del subscribers


JPEG = encode_color(np.zeros((10, 16, 3), np.uint8), PERIOD, "optical")
PNG = encode_depth(np.ones((10, 16), np.float32), PERIOD, "optical")


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    ("raw_key", "key", "image"),
    [(keys.COLOR_RAW, keys.COLOR, JPEG), (keys.DEPTH_RAW, keys.DEPTH, PNG)],
)
def test_raw_images_are_not_carried_once_compressed_ones_are_back(
    make, sessions, raw_key, key, image
):
    _, robot = sessions
    intake, streams = make()
    raw = robot.declare_publisher(f"r/{raw_key}")

    def wait_until(is_wanted, meanwhile=lambda: None):
        deadline = time.monotonic() + 10.0
        while raw.matching_status.matching != is_wanted:
            assert time.monotonic() < deadline
            meanwhile()
            take(intake, streams, 0.05)

    for _ in range(2):  # The line is broken for a while, and comes back.
        wait_until(is_wanted=True)
        wait_until(is_wanted=False, meanwhile=lambda: robot.put(f"r/{key}", image))


def test_raw_depth_is_asked_for_at_once_and_until_compressed_depth_can_be_read(make, sessions):
    _, robot = sessions
    intake, streams = make()
    raw = robot.declare_publisher(f"r/{keys.DEPTH_RAW}")
    deadline = time.monotonic() + 20.0
    depth = intake.monitors["depth"]
    while depth.status().rejected == 0:
        assert time.monotonic() < deadline
        robot.put(f"r/{keys.DEPTH}", PNG[:-4])
        take(intake, streams, 0.05)
    assert raw.matching_status.matching
    raw.put(encode_depth_raw(np.ones((10, 16), np.float32), PERIOD, "optical"))
    while PERIOD not in intake.assembler._depths:
        assert time.monotonic() < deadline
        take(intake, streams, 0.05)


def test_tf_of_the_robot_wins_over_odometry(make, sessions):
    _, robot = sessions
    intake, streams = make()
    robot.put(f"r/{keys.TF}", encode_transforms([]))
    deadline = time.monotonic() + 5.0
    while not intake.has_tf and time.monotonic() < deadline:
        time.sleep(0.01)
    for k in range(1, 20):
        send(robot, k * PERIOD)
        assert take(intake, streams, 0.05) is None
    assert intake.assembler.camera_frame == "optical"


def test_a_camera_that_tilts_needs_tf_and_the_operator_reads_so(make, sessions, events):
    _, robot = sessions
    intake, streams = make(ZED)
    deadline, stamp = time.monotonic() + 10.0, PERIOD
    while not events and time.monotonic() < deadline:
        send(robot, stamp)
        stamp += PERIOD
        take(intake, streams, 0.05)
    [text] = events
    assert text.startswith("pose: odom: odometry without tf does not tell the tilt")


def _fixed(parent, child, z):
    """Return a message of tf_static with one transform along z."""
    T = make_transform(np.eye(3), (0.0, 0.0, z))
    link = StampedTransform(stamp_ns=1, parent=parent, child=child, T_parent_child=T)
    return encode_transforms([link])


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    ("child", "fixed", "height_m"),
    [
        ("", None, 0.0),
        ("base_footprint", None, 0.0),
        ("base_footprint", ("base_footprint", "base_link", 0.1), 0.1),
    ],
)
def test_odometry_of_a_frame_that_is_the_base_is_honoured(
    make, sessions, events, child, fixed, height_m
):
    _, robot = sessions
    intake, streams = make()
    frame, stamp, deadline = None, PERIOD, time.monotonic() + 15.0
    while frame is None and time.monotonic() < deadline:
        if fixed is not None:
            robot.put(f"r/{keys.TF_STATIC}", _fixed(*fixed))
        send(robot, stamp, child=child)
        stamp += PERIOD
        frame = take(intake, streams, 0.2)
    assert frame is not None
    assert frame.T_world_base[:3, 3] == pytest.approx((1.5, 0.5, height_m))
    assert events == []


@pytest.mark.parametrize(
    ("child", "fixed"),
    [("optical", None), ("chassis", ("base_link", "lidar", 0.5)),
     ("camera_link", ("base_link", "camera_link", 0.5))],
)  # fmt: skip
def test_odometry_of_another_frame_is_refused_and_the_operator_reads_so_once(
    make, sessions, events, child, fixed
):
    _, robot = sessions
    intake, streams = make()
    if fixed is not None:
        kept = robot.declare_publisher(f"r/{keys.TF_STATIC}")
        deadline = time.monotonic() + 10.0
        while not kept.matching_status.matching and time.monotonic() < deadline:
            time.sleep(0.01)
        kept.put(_fixed(*fixed))
    deadline, n = time.monotonic() + 10.0, 0
    while (n < 20 or not events) and time.monotonic() < deadline:
        n += 1
        send(robot, n * PERIOD, child=child)
        assert take(intake, streams, 0.05) is None
    [text] = events
    assert text == (
        f"pose: odom: odometry is the pose of '{child}', and not of 'base_link': give it the "
        "child frame 'base_link', or publish tf, or a fixed transform from that frame to "
        "'base_link'"
    )
    assert intake.monitors["pose"].age_s() is None


def test_a_damaged_message_is_reported_once_and_the_next_one_counts(make, sessions, events):
    _, robot = sessions
    intake, streams = make()
    deadline = time.monotonic() + 10.0
    send(robot, PERIOD)
    while not events and time.monotonic() < deadline:
        robot.put(f"r/{keys.ODOM}", b"\x00\x01\x00\x00cut")
        take(intake, streams, 0.05)
    assert [text.split(":")[:2] for text in events] == [["pose", " odom"]]
    robot.put(f"r/{keys.ODOM}", odometry(2 * PERIOD, 0.0, 0.0, 0.0))
    while intake.monitors["pose"].age_s() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert intake.monitors["pose"].age_s() is not None
