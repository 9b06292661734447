import asyncio

import msgspec
import numpy as np
import pytest

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import decompress_color, encode_color
from app.messages.motion import StampedTwist, encode_twist
from app.messages.perception.detections import encode_detections
from app.messages.perception.heatmaps import encode_heatmap
from app.nodes.console.camera import camera_feed
from app.nodes.console.camera.camera_feed import CameraFeed, CameraHeader
from app.view.camera.overlays import CameraScene
from app.view.camera.stream_budget import Rung
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose
from ippon.observation import Detections, Heatmap, Instance
from ippon.robot import ZED

RUNG = Rung(longest_px=64, quality=90)
CAMERA = PinholeCamera.from_horizontal_fov(64, 48, 1.4)
BASE = base_pose(0.0, 0.0, 0.0, 0.0)
SCENE = CameraScene(
    camera=CAMERA,
    poses=((1_000, BASE @ ZED.T_base_camera(-0.35)),),
    T_world_base=BASE,
    path_world=np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]]),
    wanted="hat",
)
GREY = np.full((48, 64, 3), 128, np.uint8)


def _heatmap(stamp_ns):
    probabilities = np.zeros((6, 8, 2), np.uint8)
    probabilities[:, :4, 1] = 255
    heatmap = Heatmap(labels=("sofa",), ooi="hat", probabilities=probabilities)
    return encode_heatmap(heatmap, stamp_ns, "camera")


def _feed(stamp_ns=1_000):
    feed = CameraFeed()
    feed.show_scene(SCENE)
    feed.takers[keys.COLOR](encode_color(GREY, stamp_ns, "camera", quality=95))
    return feed


def _composed(feed, label=""):
    jpeg, header = feed.compose(feed.newest, RUNG, label)
    return decompress_color(jpeg).astype(int), msgspec.json.decode(header, type=CameraHeader)


def test_the_newest_image_comes_with_the_lines_of_the_scene():
    image, header = _composed(_feed())
    assert np.abs(image - 128).max() < 4
    assert header.stamp_ns == "1000"
    assert (header.width, header.height) == (64, 48)
    assert {line.kind for line in header.lines} == {"way", "edge"}


def test_what_the_network_sees_is_drawn_in_where_it_is():
    feed = _feed()
    feed.takers[keys.HEATMAP](_heatmap(1_000))
    image, header = _composed(feed)
    assert header.label == "hat"
    assert header.labels == ["sofa"]
    assert (image[20:30, 4:20, 1] > image[20:30, 4:20, 0] + 20).all(), "green to the left"
    assert np.abs(image[:, 44:] - 128).max() < 8
    plain, header = _composed(feed, label=None)
    assert np.abs(plain - 128).max() < 4
    assert header.label == ""


def test_an_output_of_a_second_ago_is_not_drawn_over_another_view():
    feed = _feed(stamp_ns=5_000_000_000)
    feed.takers[keys.HEATMAP](_heatmap(1_000))
    assert _composed(feed)[1].label == ""
    feed.takers[keys.HEATMAP](_heatmap(4_600_000_000))
    header = _composed(feed)[1]
    assert header.label == "hat"
    assert header.lag_ms == pytest.approx(400.0)


def test_the_boxes_of_a_detector_are_lines():
    feed = _feed()
    seen = Instance(label="hat", score=0.8, box_px=(8.0, 12.0, 32.0, 36.0))
    detections = Detections(
        labels=("hat",), ooi="hat", image_size=(48, 64), instances=(seen,), source="detector"
    )
    feed.takers[keys.BOXES](encode_detections(detections, 1_000, "camera"))
    header = _composed(feed)[1]
    (box,) = [line for line in header.lines if line.kind == "seen"]
    assert box.text == "hat 80%"
    assert box.points[0] == pytest.approx((0.125, 0.25))


def test_the_command_of_the_wheels_bends_the_way_while_it_is_fresh(monkeypatch):
    feed = _feed()
    drive = msgspec.structs.replace(SCENE.drive, mode="manual")
    feed.show_scene(CameraScene(camera=CAMERA, poses=SCENE.poses, T_world_base=BASE, drive=drive))
    twist = StampedTwist(stamp_ns=1, linear_m_s=0.6, yaw_rate_rad_s=0.3)
    feed.takers[keys.CMD_VEL](encode_twist(twist))
    (way,) = [line for line in _composed(feed)[1].lines if line.kind == "way"]
    assert way.points[-1][0] < 0.45
    monkeypatch.setattr(camera_feed, "COMMAND_S", -1.0)
    ways = [line for line in _composed(feed)[1].lines if line.kind == "way"]
    assert all(abs(x - 0.5) < 0.02 for way in ways for x, _ in way.points), "straight again"


def test_damaged_messages_change_nothing_and_a_damaged_image_is_refused():
    feed = _feed()
    for take in feed.takers.values():
        take(b"\0\1\0\0damaged")
    assert feed.newest.number == 0
    assert _composed(feed)[1].label == ""
    cut = encode_color(GREY, 2_000, "camera")
    feed.take_image(cut.replace(b"\xff\xda", b"\xff\x00"))
    with pytest.raises(MessageError, match="damaged JPEG"):
        feed.compose(feed.newest, RUNG, "")


def test_pages_that_show_the_same_share_one_encoding(monkeypatch):
    feed, encoded = _feed(), []
    original = camera_feed.encoded_picture
    monkeypatch.setattr(
        camera_feed, "encoded_picture", lambda *a: encoded.append(a) or original(*a)
    )
    for _ in range(8):
        feed.compose(feed.newest, RUNG, "")
    assert len(encoded) == 1


def test_a_follower_gets_the_newest_image_only():
    async def follow():
        feed = _feed()
        first = await feed.newer_than(-1, 1.0)
        assert await feed.newer_than(first.number, 0.01) is None
        loop = asyncio.get_running_loop()
        for stamp in (2_000, 3_000):
            await loop.run_in_executor(None, feed.take_image, encode_color(GREY, stamp, "camera"))
        return await feed.newer_than(first.number, 1.0)

    assert asyncio.run(follow()).image.stamp_ns == 3_000
