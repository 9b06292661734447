import struct

import numpy as np
import pytest
import simplejpeg
import zstandard

from app.messages.cdr import MessageError, decode, encode, header
from app.messages.images import (
    decode_camera,
    decode_color,
    decode_color_raw,
    decompress_color,
    encode_camera,
    encode_color,
)
from app.messages.perception.heatmaps import decode_heatmap, encode_heatmap
from ippon.camera import PinholeCamera
from ippon.observation import Heatmap
from tests.app.messages.robot_messages import FRAME, STAMP, compressed, png, raw_color


@pytest.fixture
def color():
    v, u = np.mgrid[0:60, 0:80]
    return np.stack([3 * u, 4 * v, 255 - u], axis=2).astype(np.uint8)


@pytest.fixture
def heatmap():
    probabilities = np.random.default_rng(2).integers(0, 255, (6, 8, 3), dtype=np.uint8)
    return Heatmap(labels=("wall", "sofa"), ooi="hat", probabilities=probabilities)


def test_color_comes_back_as_the_jpeg_that_was_sent(color):
    message = decode_color(encode_color(color, STAMP, FRAME))
    assert (message.stamp_ns, message.frame_id) == (STAMP, FRAME)
    assert np.abs(decompress_color(message.encoded).astype(int) - color).mean() < 4.0


def test_png_color_is_exact(color):
    message = decode_color(compressed("png", png(color)))
    np.testing.assert_array_equal(decompress_color(message.encoded), color)


def test_what_is_neither_jpeg_nor_png_is_refused():
    with pytest.raises(MessageError, match="JPEG or PNG"):
        decode_color(compressed("h264", b"\0\0\0\1abc"))


def test_a_huge_jpeg_is_refused_before_it_is_decompressed(color):
    jpeg = bytearray(simplejpeg.encode_jpeg(color))
    frame_header = jpeg.index(b"\xff\xc0")
    jpeg[frame_header + 5 : frame_header + 9] = struct.pack(">HH", 65000, 65000)
    with pytest.raises(MessageError, match="65000x65000 pixels is not accepted"):
        decompress_color(bytes(jpeg))


@pytest.mark.parametrize(
    ("encoding", "order"),
    [("rgb8", [0, 1, 2]), ("bgr8", [2, 1, 0]), ("rgba8", [0, 1, 2, 0]), ("bgra8", [2, 1, 0, 0])],
)
@pytest.mark.parametrize("pad", [0, 5])
def test_raw_color_of_every_order_of_channels(color, encoding, order, pad):
    payload = raw_color(color[:, :, order], 12, encoding, pad)
    pixels, stamp_ns, frame_id = decode_color_raw(payload)
    np.testing.assert_array_equal(pixels, color)
    assert (stamp_ns, frame_id) == (12, "optical")


def test_grey_images_become_rgb_and_others_are_refused(color):
    grey = color[:, :, :1]
    np.testing.assert_array_equal(
        decode_color_raw(raw_color(grey, 1, "mono8"))[0], np.repeat(grey, 3, axis=2)
    )
    with pytest.raises(MessageError, match=r"is rgb8, bgr8, rgba8, bgra8, mono8; got .*bayer"):
        decode_color_raw(raw_color(grey, 1, "bayer_rggb8"))
    with pytest.raises(MessageError, match="does not come in"):
        decode_color_raw(raw_color(grey, 1, "rgb8"))


def test_camera_round_trip():
    camera = PinholeCamera.from_horizontal_fov(400, 250, 1.2)
    message = decode_camera(encode_camera(camera, STAMP, FRAME))
    assert (message.camera, message.stamp_ns, message.frame_id) == (camera, STAMP, FRAME)


def test_a_distorted_camera_is_refused():
    typename = "sensor_msgs/msg/CameraInfo"
    info = decode(encode_camera(PinholeCamera.from_horizontal_fov(40, 25, 1.2), 0, ""), typename)
    fields = {name: getattr(info, name) for name in info.__dataclass_fields__ if name[0] != "_"}
    fields["d"] = np.array([0.1, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(MessageError, match="publish the rectified image"):
        decode_camera(encode(typename, **fields))


def test_heatmap_round_trip(heatmap):
    message = decode_heatmap(encode_heatmap(heatmap, STAMP, FRAME))
    assert (message.stamp_ns, message.frame_id) == (STAMP, FRAME)
    assert (message.heatmap.labels, message.heatmap.ooi) == (heatmap.labels, heatmap.ooi)
    np.testing.assert_array_equal(message.heatmap.probabilities, heatmap.probabilities)


def heatmap_message(**changes):
    fields = {
        "header": header(STAMP, FRAME),
        "height": 2,
        "width": 2,
        "labels": ["wall"],
        "ooi": "",
        "encoding": "raw",
        "data": np.arange(4, dtype=np.uint8),
    }
    return encode("ippon_msgs/msg/Heatmap", **{**fields, **changes})


def test_uncompressed_heatmap_without_an_object():
    heatmap = decode_heatmap(heatmap_message()).heatmap
    assert heatmap.ooi is None
    np.testing.assert_array_equal(heatmap.probabilities[..., 0], [[0, 1], [2, 3]])


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"width": 3}, "data are 4 bytes, the stated size is 6"),
        ({"labels": []}, "1 to 512 channels; got 0"),
        ({"encoding": "lz4"}, "raw, zstd or top-zstd; got 'lz4'"),
        ({"height": 2**31, "width": 2**31}, "pixels is not accepted"),
        ({"height": 4096, "width": 4096, "labels": [str(i) for i in range(40)]}, "is over"),
        ({"encoding": "zstd"}, "damaged heatmap data"),
    ],
)
def test_contradictions_in_a_heatmap_are_refused(changes, text):
    with pytest.raises(MessageError, match=text):
        decode_heatmap(heatmap_message(**changes))


def test_a_heatmap_bomb_is_refused_unopened():
    bomb = zstandard.ZstdCompressor().compress(bytes(10_000_000))
    with pytest.raises(MessageError, match="do not unpack to 4 bytes"):
        decode_heatmap(heatmap_message(encoding="zstd", data=np.frombuffer(bomb, np.uint8)))


def test_damaged_bytes_never_do_more_than_a_message_error(survives_damage, color, heatmap):
    def color_all_the_way(payload):
        decompress_color(decode_color(payload).encoded)

    camera = PinholeCamera.from_horizontal_fov(40, 25, 1.2)
    survives_damage(color_all_the_way, encode_color(color, STAMP, FRAME))
    survives_damage(decode_camera, encode_camera(camera, STAMP, FRAME))
    survives_damage(decode_heatmap, encode_heatmap(heatmap, STAMP, FRAME))
