import math

import numpy as np
import pytest

from app.links.robot_streams.assembler import MAX_PENDING, AssemblerConfig, FrameAssembler
from app.messages.cdr import MessageError
from app.messages.depth.depth_images import DepthImage
from app.messages.images import CompressedColor, StampedCamera, decode_color, encode_color
from app.messages.motion import StampedTransform
from app.messages.perception.detections import StampedBoxes
from app.messages.perception.heatmaps import StampedHeatmap
from ippon.camera import PinholeCamera
from ippon.errors import FrameRejectedError
from ippon.geometry import base_pose
from ippon.observation import Heatmap
from ippon.robot import ZED

CAMERA = PinholeCamera.from_horizontal_fov(16, 10, 1.2)
OPTICAL = "camera_color_optical_frame"
PERIOD = 200_000_000


def color(stamp_ns):
    image = np.full((10, 16, 3), 128, np.uint8)
    return decode_color(encode_color(image, stamp_ns, OPTICAL))


def depth(stamp_ns, shape=(10, 16)):
    return DepthImage(stamp_ns=stamp_ns, frame_id=OPTICAL, depth=np.ones(shape, np.float32))


def heatmap(stamp_ns):
    probabilities = np.zeros((2, 3, 1), np.uint8)
    return StampedHeatmap(
        stamp_ns=stamp_ns,
        frame_id=OPTICAL,
        heatmap=Heatmap(labels=("wall",), ooi=None, probabilities=probabilities),
    )


def poses(stamp_ns, x=1.0, yaw=0.3, tilt=-0.4):
    def stamped(parent, child, T):
        return StampedTransform(stamp_ns=stamp_ns, parent=parent, child=child, T_parent_child=T)

    return (
        stamped("map", "base_link", base_pose(x, 2.0, 0.0, yaw)),
        stamped("base_link", OPTICAL, ZED.T_base_camera(tilt)),
    )


@pytest.fixture
def assembler():
    assembler = FrameAssembler()
    assembler.add_camera(StampedCamera(stamp_ns=0, frame_id=OPTICAL, camera=CAMERA))
    return assembler


def feed(assembler, stamp_ns, *, with_heatmap=True):
    assembler.add_transforms(poses(stamp_ns))
    if with_heatmap:
        assembler.add_heatmap(heatmap(stamp_ns))
    assembler.add_depth(depth(stamp_ns))
    assembler.add_color(color(stamp_ns))


def test_the_pose_is_that_of_the_poses_clock():
    config = AssemblerConfig(camera_clock_offset_s=0.04)
    assembler = FrameAssembler(config)
    assembler.add_camera(StampedCamera(stamp_ns=0, frame_id=OPTICAL, camera=CAMERA))
    for stamp_ns, x in ((PERIOD, 1.0), (PERIOD + 80_000_000, 2.0)):
        assembler.add_transforms(poses(stamp_ns, x=x))
    assembler.add_depth(depth(PERIOD))
    assembler.add_color(color(PERIOD))
    frame = assembler.take()
    assert frame.stamp_ns == PERIOD
    assert frame.T_world_base[0, 3] == pytest.approx(1.5)


def test_a_frame_carries_what_came(assembler):
    feed(assembler, PERIOD)
    frame = assembler.take()
    assert frame.stamp_ns == PERIOD
    assert frame.color.shape == (10, 16, 3)
    assert frame.heatmap is not None
    assert frame.tilt_rad == pytest.approx(-0.4)
    np.testing.assert_allclose(frame.T_world_base, base_pose(1.0, 2.0, 0.0, 0.3), atol=1e-12)
    expected = base_pose(1.0, 2.0, 0.0, 0.3) @ ZED.T_base_camera(-0.4)
    np.testing.assert_allclose(frame.T_world_camera, expected, atol=1e-12)
    assert assembler.take() is None


@pytest.mark.parametrize("order", range(6))
def test_any_order_gives_the_frame(assembler, order):
    parts = [
        lambda: assembler.add_color(color(PERIOD)),
        lambda: assembler.add_depth(depth(PERIOD)),
        lambda: assembler.add_transforms(poses(PERIOD)),
    ]
    first = parts.pop(order % 3)
    if order >= 3:
        parts.reverse()
    for part in (first, *parts):
        assert assembler.take() is None
        part()
    assert assembler.take().stamp_ns == PERIOD


def test_pose_between_two_messages(assembler):
    assembler.add_transforms(poses(0, x=1.0))
    assembler.add_transforms(poses(PERIOD, x=2.0))
    assembler.add_depth(depth(PERIOD // 4))
    assembler.add_color(color(PERIOD // 4))
    assert assembler.take().T_world_base[0, 3] == pytest.approx(1.25)


def test_stamps_that_nearly_agree_belong_together(assembler):
    assembler.add_transforms(poses(PERIOD))
    assembler.add_depth(depth(PERIOD + 15_000_000))
    assembler.add_color(color(PERIOD))
    assert assembler.take().stamp_ns == PERIOD


def test_the_newest_frame_wins_and_the_skipped_are_counted(assembler):
    for k in range(1, 4):
        feed(assembler, k * PERIOD)
    assert assembler.take().stamp_ns == 3 * PERIOD
    assert assembler.take() is None
    assert assembler.skipped == 2


def test_a_frame_waits_for_its_heatmap_where_there_are_heatmaps(assembler):
    feed(assembler, PERIOD)
    assert assembler.take().heatmap is not None
    feed(assembler, 2 * PERIOD, with_heatmap=False)
    assert assembler.take() is None
    assembler.add_heatmap(heatmap(2 * PERIOD))
    assert assembler.take().heatmap is not None


def test_a_heatmap_that_never_comes_is_not_waited_for_for_ever(assembler):
    feed(assembler, PERIOD)
    assembler.take()
    frames = []
    for k in range(2, 12):
        feed(assembler, k * PERIOD, with_heatmap=False)
        frames.append(assembler.take())
    assert any(frame is not None and frame.heatmap is None for frame in frames)


def test_a_press_of_the_bumper_is_carried_once(assembler):
    assembler.add_contact(pressed=True)
    assembler.add_contact(pressed=False)
    feed(assembler, PERIOD)
    assert assembler.take().contact
    feed(assembler, 2 * PERIOD)
    assert not assembler.take().contact


def test_a_bumper_that_tells_its_changes_only_is_pressed_until_its_release(assembler):
    assembler.add_contact(pressed=True)
    for k in (1, 2):
        feed(assembler, k * PERIOD)
        assert assembler.take().contact
    assembler.add_contact(pressed=False)
    feed(assembler, 3 * PERIOD)
    assert not assembler.take().contact


def test_a_bumper_does_not_stay_pressed_where_the_robot_starts_again(assembler):
    assembler.add_contact(pressed=True)
    feed(assembler, 100 * PERIOD)
    assert assembler.take().contact
    feed(assembler, PERIOD)
    assert assembler.restarts == 1
    assert not assembler.take().contact


def test_old_stamps_are_not_offered_again(assembler):
    feed(assembler, 3 * PERIOD)
    assembler.take()
    feed(assembler, 2 * PERIOD)
    assert assembler.take() is None
    assert assembler.restarts == 0


def test_a_robot_that_starts_anew(assembler):
    feed(assembler, 100 * PERIOD)
    assembler.take()
    feed(assembler, PERIOD)
    assert assembler.take().stamp_ns == PERIOD
    assert assembler.restarts == 1


def test_parts_that_contradict_each_other_are_refused_once(assembler):
    assembler.add_transforms(poses(PERIOD))
    assembler.add_depth(depth(PERIOD, (5, 8)))
    assembler.add_color(color(PERIOD))
    with pytest.raises(FrameRejectedError, match=r"depth is \(5, 8\)"):
        assembler.take()
    assert assembler.take() is None


def test_damaged_images_are_refused_once(assembler):
    assembler.add_transforms(poses(PERIOD))
    assembler.add_depth(depth(PERIOD))
    torn = CompressedColor(stamp_ns=PERIOD, frame_id=OPTICAL, encoded=b"\xff\xd8\xff\xe0torn")
    assembler.add_color(torn)
    with pytest.raises(MessageError, match="damaged JPEG"):
        assembler.take()
    assert assembler.take() is None


def test_stamps_from_the_future_do_not_block_the_present(assembler):
    for k in range(3 * MAX_PENDING):
        future = 2_000_000_000 * 1_000_000_000 + k
        assembler.add_color(color(future))
        assembler.add_depth(depth(future - 10**12))
        assembler.add_heatmap(heatmap(future))
    taken = []
    for k in range(1, 3 * MAX_PENDING):
        feed(assembler, k * PERIOD)
        taken.append(assembler.take())
    assert any(frame is not None and frame.heatmap is not None for frame in taken)
    assert sum(frame is not None for frame in taken) > MAX_PENDING


def test_a_single_missing_heatmap_costs_one_frame(assembler):
    feed(assembler, PERIOD)
    assembler.take()
    feed(assembler, 2 * PERIOD, with_heatmap=False)
    assert assembler.take() is None
    feed(assembler, 3 * PERIOD)
    assert assembler.take().stamp_ns == 3 * PERIOD
    assert assembler.skipped == 1


def test_the_tilt_is_the_angle_of_the_optical_axis(assembler):
    for k, tilt in enumerate((-1.2, 0.0, 0.43), start=1):
        stamp = k * PERIOD
        assembler.add_transforms(poses(stamp, yaw=2.0, tilt=tilt))
        assembler.add_depth(depth(stamp))
        assembler.add_color(color(stamp))
        assert assembler.take().tilt_rad == pytest.approx(tilt, abs=1e-9)
        assert math.isfinite(tilt)


def test_it_says_what_is_missing():
    assembler = FrameAssembler()
    assert assembler.missing() == "colour images"
    assembler.add_color(color(PERIOD))
    assert assembler.missing() == "camera info"
    assembler.add_camera(StampedCamera(stamp_ns=0, frame_id=OPTICAL, camera=CAMERA))
    assert "depth image" in assembler.missing()
    assembler.add_depth(depth(PERIOD))
    assert assembler.missing() == f"tf from map to {OPTICAL} at the stamp of the images"
    assembler.add_transforms(poses(PERIOD))
    assert assembler.missing() == ""
    assert assembler.take() is not None
    assert assembler.missing() == ""
    assembler.add_color(color(PERIOD))
    assert assembler.take() is None
    assert assembler.missing() == "colour images with a new stamp"


def test_a_late_heatmap_is_joined_to_the_frame_that_went_without_it(assembler):
    feed(assembler, PERIOD)
    assert assembler.take().heatmap is not None
    frames = []
    for k in range(2, 9):
        feed(assembler, k * PERIOD, with_heatmap=False)
        frames.append(assembler.take())
    went = [frame for frame in frames if frame is not None]
    assert went
    assert assembler.take_late() is None
    first, second = went[0], went[1]
    assembler.add_heatmap(heatmap(second.stamp_ns + 1_000))
    late = assembler.take_late()
    assert late.stamp_ns == second.stamp_ns
    assert late.heatmap is not None
    np.testing.assert_array_equal(late.T_world_camera, second.T_world_camera)
    assert assembler.take_late() is None
    # Heatmaps come in order: what is older than the last one is not kept for one.
    assembler.add_heatmap(heatmap(first.stamp_ns))
    assert assembler.take_late() is None
    # What the map refused learns nothing later either.
    assembler.forget(went[2].stamp_ns)
    assembler.add_heatmap(heatmap(went[2].stamp_ns))
    assert assembler.take_late() is None


def test_frames_are_not_kept_where_nobody_segments(assembler):
    for k in range(1, 40):
        feed(assembler, k * PERIOD, with_heatmap=False)
        assembler.take()
    assert not assembler._without


def test_late_heatmaps_are_forgotten_with_the_old_clock(assembler):
    feed(assembler, 100 * PERIOD)
    assembler.take()
    for k in range(101, 109):
        feed(assembler, k * PERIOD, with_heatmap=False)
        assembler.take()
    feed(assembler, PERIOD)
    assembler.add_heatmap(heatmap(108 * PERIOD))
    assert assembler.take_late() is None


def test_a_heatmap_of_the_old_clock_does_not_hold_up_the_frames_of_the_new_one(assembler):
    feed(assembler, 100 * PERIOD)
    assembler.take()
    feed(assembler, PERIOD, with_heatmap=False)
    assembler.take()
    assembler.add_heatmap(heatmap(101 * PERIOD))
    for k in range(2, 6):
        feed(assembler, k * PERIOD, with_heatmap=False)
        assert assembler.take() is not None


def boxes(stamp_ns):
    return StampedBoxes(
        stamp_ns=stamp_ns,
        frame_id=OPTICAL,
        boxes_px=np.array([[4.0, 2.0, 12.0, 8.0]]),
        scores=np.array([0.9]),
        names=("cup",),
        numbers=np.array([1]),
        count=1,
    )


def test_detections_become_the_heatmap_of_their_frame(assembler):
    assembler.detector.ask(("wall",), "cup")
    assembler.add_boxes(boxes(PERIOD))
    feed(assembler, PERIOD, with_heatmap=False)
    heatmap = assembler.take().heatmap
    assert (heatmap.kind, heatmap.ooi) == ("scores", "cup")
    assert heatmap.probabilities[5, 8, 0] == 230


def test_a_detector_that_lags_teaches_with_the_pose_of_its_image(assembler):
    """The robot turns; what comes a second late belongs where the camera looked then."""
    assembler.detector.ask(("wall",), "cup")
    assembler.add_boxes(boxes(PERIOD))
    for n in range(1, 8):
        assembler.add_transforms(poses(n * PERIOD, yaw=0.3 * n))
        assembler.add_depth(depth(n * PERIOD))
        assembler.add_color(color(n * PERIOD))
        assembler.take()
    assembler.add_boxes(boxes(3 * PERIOD))
    late = assembler.take_late()
    assert late.stamp_ns == 3 * PERIOD
    assert late.heatmap.ooi == "cup"
    np.testing.assert_allclose(late.T_world_base, base_pose(1.0, 2.0, 0.0, 0.9), atol=1e-12)
    assert assembler.take_late() is None


@pytest.mark.parametrize("behind", [3, 8, 30])
def test_what_a_slow_network_sees_is_joined_however_late(assembler, behind):
    """Up to 6 s: only a step back of images says that the robot's clock was set back."""
    joined = []
    for k in range(1, 100):
        feed(assembler, k * PERIOD, with_heatmap=False)
        assembler.take()
        if k > behind:
            assembler.add_heatmap(heatmap((k - behind) * PERIOD))
            late = assembler.take_late()
            joined += [] if late is None else [late.stamp_ns]
    assert assembler.restarts == 0
    assert len(joined) > 20


def test_detections_with_the_stamp_of_no_image_are_counted(assembler):
    for n in range(1, 6):
        feed(assembler, n * PERIOD, with_heatmap=False)
        assembler.take()
        assembler.add_boxes(boxes(n * PERIOD + PERIOD // 2))
    assert assembler.unmatched == 4
    assert assembler.take_late() is None
    for n in (5, 6):
        feed(assembler, n * PERIOD, with_heatmap=False)
        assembler.add_boxes(boxes(n * PERIOD))
    assert assembler.unmatched == 0
