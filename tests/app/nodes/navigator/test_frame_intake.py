import itertools
import time

import numpy as np
import pytest

from app.messages import keys
from app.messages.depth.depth_images import encode_depth
from app.messages.images import encode_camera, encode_color
from app.messages.motion import (
    StampedTransform,
    encode_flag,
    encode_transforms,
    robot_transforms,
)
from app.nodes.navigator.frame_intake import MAX_WAITING, MISFITS, FrameIntake, Stopwatch
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose
from ippon.robot import ZED

CAMERA = PinholeCamera.from_horizontal_fov(16, 10, 1.2)
OPTICAL = "optical"
PERIOD = 200_000_000
PATIENCE_S = 20.0


@pytest.fixture
def complaints():
    return []


@pytest.fixture
def intake(sessions, complaints):
    return FrameIntake(sessions[0], "r", complaints.append)


@pytest.fixture
def send(sessions):
    """Publish one frame as a robot does; `without` leaves topics away."""
    _, robot = sessions

    def put(stamp_ns, *, without=(), depth_shape=(10, 16)):
        T_world_base, mount = base_pose(1.0, 0.0, 0.0, 0.0), ZED.T_base_camera(0.0)
        poses = robot_transforms(stamp_ns, T_world_base, mount, OPTICAL)
        payloads = {
            keys.TF: encode_transforms(poses),
            keys.CAMERA_INFO: encode_camera(CAMERA, stamp_ns, OPTICAL),
            keys.CONTACT: encode_flag(True),
            keys.DEPTH: encode_depth(np.ones(depth_shape, np.float32), stamp_ns, OPTICAL),
            keys.COLOR: encode_color(np.full((10, 16, 3), 99, np.uint8), stamp_ns, OPTICAL),
        }
        for topic, payload in payloads.items():
            if topic not in without:
                robot.put(f"r/{topic}", payload)

    return put


def take(intake, timeout_s=5.0):
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        frame = intake.take(0.1)
        if frame is not None:
            return frame
    return None


def test_a_frame_arrives(intake, send, complaints):
    send(PERIOD)
    frame = take(intake)
    assert (frame.stamp_ns, frame.contact, intake.frames) == (PERIOD, True, 1)
    assert intake.lost(PATIENCE_S) == []
    assert complaints == []


def test_a_wait_ends_when_somebody_wakes_it(intake):
    intake.wake()
    started = time.monotonic()
    assert intake.take(0.2) is None
    assert time.monotonic() - started < 1.0


def test_before_the_first_message_everything_is_lost(intake):
    assert [name for name, _ in intake.lost(1.0)] == ["colour", "depth", "pose"]


def until(condition, meanwhile=lambda: None, timeout_s=10.0):
    deadline = time.monotonic() + timeout_s
    while not (met := condition()):
        assert time.monotonic() < deadline
        meanwhile()
        time.sleep(0.01)
    return met


def test_a_silent_stream_is_named(intake, send):
    send(PERIOD)
    take(intake)
    time.sleep(0.6)
    stamps = itertools.count(2 * PERIOD, PERIOD)

    def go_on():
        send(next(stamps), without=(keys.DEPTH,))
        assert take(intake, 0.1) is None

    until(lambda: [name for name, _ in intake.lost(0.4)] == ["depth"], go_on)


def test_the_end_of_a_replay_is_known_until_another_image_comes(intake, send, sessions):
    send(PERIOD)
    take(intake)
    sessions[1].put(
        f"r/{keys.ENDED}", b"the replay of kitchen has ended\n\x00: 3 images" + b"x" * 999
    )
    deadline = time.monotonic() + 5.0
    while not intake.ended:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert intake.ended.startswith("the replay of kitchen has ended: 3 images")
    assert len(intake.ended) <= 200
    send(2 * PERIOD)
    take(intake)
    assert intake.ended == ""


def test_streams_that_do_not_fit_together_are_lost_too(intake, send):
    send(PERIOD)
    take(intake)
    time.sleep(0.6)
    stamps = itertools.count(2 * PERIOD, 2 * PERIOD)

    def go_on():
        send(next(stamps), without=(keys.COLOR,))
        send(next(stamps), without=(keys.DEPTH,))
        assert take(intake, 0.1) is None

    misfit = "depth images with the stamp of the colour image"

    def only_misfits():
        lost = intake.lost(0.4)
        return lost if [name for name, _ in lost] == [misfit] else []

    ((_, age),) = until(only_misfits, go_on)
    assert age > 0.4


def test_a_flood_is_dropped_and_counted_and_the_newest_wins(intake, send):
    send(PERIOD)
    take(intake)
    for k in range(2, 30):
        send(k * PERIOD)
    deadline = time.monotonic() + 5.0
    while intake.monitors["colour"].status().dropped < 28 - MAX_WAITING:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert take(intake).stamp_ns == 29 * PERIOD


def test_fixed_transforms_of_many_publishers_that_come_together_all_count(intake):
    links = [keys.BASE_FRAME, *(f"link_{k}" for k in range(8)), OPTICAL]
    for parent, child in itertools.pairwise(links):
        transform = StampedTransform(
            stamp_ns=0, parent=parent, child=child, T_parent_child=base_pose(0.1, 0.0, 0.0, 0.0)
        )
        intake.inject(keys.TF_STATIC, encode_transforms([transform]))
    assert intake.take(0.0) is None
    pose = intake.assembler._transforms.lookup(keys.BASE_FRAME, OPTICAL, 0)
    assert pose[0, 3] == pytest.approx(0.9)


def test_what_is_broken_is_refused_and_said_once(intake, send, sessions, complaints):
    for _ in range(3):
        sessions[1].put(f"r/{keys.DEPTH}", b"garbage")
        send(PERIOD, without=(keys.DEPTH,))
        take(intake, 0.2)
    until(lambda: intake.monitors["depth"].status().rejected == 3, lambda: intake.take(0.05))
    assert len(complaints) == 1
    assert "not a sensor_msgs/msg/CompressedImage (7 bytes)" in complaints[0]


def test_a_refused_camera_info_is_no_fault_of_the_pose(intake, complaints):
    intake.inject(keys.CAMERA_INFO, encode_camera(CAMERA, PERIOD, OPTICAL)[:-8])
    intake.take(0.0)
    assert intake.monitors["pose"].status().rejected == 0
    assert complaints[0].startswith(f"colour: {keys.CAMERA_INFO}: ")
    assert intake.camera_refused in complaints[0]
    intake.inject(keys.CAMERA_INFO, encode_camera(CAMERA, PERIOD, OPTICAL))
    intake.take(0.0)
    assert intake.camera_refused == ""


def test_a_frame_that_contradicts_itself_is_refused(intake, send, complaints):
    send(PERIOD, depth_shape=(5, 8))
    until(lambda: intake.monitors["depth"].status().rejected == 1, lambda: take(intake, 0.1))
    assert intake.frames == 0
    assert "depth is (5, 8)" in complaints[0]
    assert "depth is (5, 8)" in intake.refused
    intake.accept()
    assert intake.refused == ""


@pytest.mark.parametrize(
    ("problem", "stream"),
    [
        ("the camera jumped 3.00 m in 0.200 s; at most 2 m/s is believed", "pose"),
        ("T_world_base is not a rigid transform", "pose"),
        ("depth has no finite value: NaN or infinite everywhere", "depth"),
        ("colour is (5, 8, 3) uint8; the camera takes (10, 16, 3) uint8", "colour"),
        ("heatmap does not fit", "heatmap"),
    ],
)
def test_a_refused_frame_counts_under_the_stream_at_fault(intake, problem, stream):
    intake.refuse_frame(problem)
    rejected = {name: m.status().rejected for name, m in intake.monitors.items()}
    assert rejected == {name: int(name == stream) for name in rejected}


def test_the_age_of_a_frame_counts_from_its_own_arrival(intake, send):
    send(PERIOD)
    take(intake)
    first, arrivals = intake.arrived_at, intake.monitors["colour"]._arrivals
    send(2 * PERIOD)
    until(lambda: len(arrivals) == 2)
    time.sleep(0.3)
    # A newer image, that is not complete yet, must not make the older frame look fresh.
    send(3 * PERIOD, without=(keys.DEPTH,))
    until(lambda: len(arrivals) == 3)
    time.sleep(0.2)
    frame = take(intake)
    assert frame.stamp_ns == 2 * PERIOD
    assert intake.arrived_at > first
    assert time.perf_counter() - intake.arrived_at > 0.4


def test_medians():
    watch = Stopwatch(size=3)
    assert watch.median_ms("step") == 0.0
    for seconds in (9.0, 0.001, 0.003, 0.002):
        watch.add("step", seconds)
    assert watch.median_ms("step") == pytest.approx(2.0)


def test_a_detector_in_other_units_is_told(intake):
    detector = intake.assembler.detector
    detector.misfits = MISFITS - 1
    assert intake.notes() == ()
    detector.misfits = MISFITS
    (note,) = intake.notes()
    assert "boxes are in pixels of the colour image" in note
