import io
import struct

import numpy as np
import pytest
from PIL import Image

from app.messages.cdr import MessageError, encode, header
from app.messages.depth.depth_images import (
    decode_depth,
    decode_depth_raw,
    depth_png,
    encode_depth,
    encode_depth_raw,
)
from tests.app.messages.depth.test_rvl import encode_rvl
from tests.app.messages.robot_messages import FRAME, STAMP, compressed, png

HEADER = struct.pack("<iff", 0, 0.0, 0.0)


@pytest.fixture
def depth():
    values = np.random.default_rng(1).uniform(0.3, 5.0, (60, 80)).astype(np.float32)
    values[:5] = 0.0
    return values


@pytest.mark.parametrize(
    ("encode_", "decode_"), [(encode_depth, decode_depth), (encode_depth_raw, decode_depth_raw)]
)
def test_depth_keeps_millimetres_and_holes(depth, encode_, decode_):
    message = decode_(encode_(depth, STAMP, FRAME))
    assert (message.stamp_ns, message.frame_id) == (STAMP, FRAME)
    assert message.depth.dtype == np.float32
    assert np.abs(message.depth - depth).max() <= 0.0005 + 1e-6
    assert (message.depth[:5] == 0.0).all()


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, 70.0])
def test_depth_that_millimetres_cannot_hold_is_no_return(value):
    depth = np.full((4, 4), value, np.float32)
    assert (decode_depth(encode_depth(depth, STAMP, FRAME)).depth == 0.0).all()


def raw_image(encoding, values, *, big=0, pad=0):
    rows = values.view(np.uint8).reshape(len(values), -1)
    rows = np.pad(rows, ((0, 0), (0, pad)))
    return encode(
        "sensor_msgs/msg/Image",
        header=header(STAMP, FRAME),
        height=values.shape[0],
        width=values.shape[1],
        encoding=encoding,
        is_bigendian=big,
        step=rows.shape[1],
        data=np.ascontiguousarray(rows).reshape(-1),
    )


def test_float_depth_with_padded_rows_and_nan():
    values = np.array([[1.5, np.nan], [np.inf, -2.0]], np.float32)
    message = decode_depth_raw(raw_image("32FC1", values, pad=6))
    np.testing.assert_array_equal(message.depth, [[1.5, 0.0], [0.0, 0.0]])


def test_big_endian_millimetres():
    values = np.array([[1500, 0]], ">u2")
    message = decode_depth_raw(raw_image("16UC1", values, big=1))
    np.testing.assert_allclose(message.depth, [[1.5, 0.0]])


def test_other_depth_encodings_are_refused():
    with pytest.raises(MessageError, match="16UC1 in mm or 32FC1 in m; got encoding 'rgb8'"):
        decode_depth_raw(raw_image("rgb8", np.zeros((2, 3), np.uint8)))
    data = struct.pack("<iff", 0, 0, 0) + png(np.zeros((3, 3), np.uint8))
    with pytest.raises(MessageError, match="16-bit grey PNG; got mode L"):
        decode_depth(compressed("16UC1; compressedDepth png", data))
    with pytest.raises(MessageError, match="compressed depth is 16UC1 or 32FC1; got format '8UC1"):
        decode_depth(compressed("8UC1; compressedDepth png", b"0" * 40))


@pytest.mark.parametrize(("codec", "pack"), [("png", png), ("rvl", encode_rvl)])
def test_quantised_inverse_depth(codec, pack):
    # The encoder of compressed_depth_image_transport, with its usual depth_max and quantization.
    depth_max, quantization = 10.0, 100.0
    factor = quantization * (quantization + 1.0)
    offset = 1.0 - factor / depth_max
    depth = np.array([[0.5, 1.0, 3.0, 9.9], [0.0, 0.0, 2.0, 4.0]], np.float32)
    with np.errstate(divide="ignore"):
        inverse = np.where(depth > 0.0, factor / depth + offset, 0.0).astype(np.uint16)
    payload = compressed(
        f"32FC1; compressedDepth {codec}", struct.pack("<iff", 0, factor, offset) + pack(inverse)
    )
    read = decode_depth(payload).depth
    assert read.dtype == np.float32
    # A step of the inverse depth is depth^2 / factor.
    assert np.all(np.abs(read - depth) <= depth**2 / factor + 1e-6)
    stamp_ns, frame, image = depth_png(payload)
    assert (stamp_ns, frame) == (STAMP, FRAME)
    millimetres = np.asarray(Image.open(io.BytesIO(image)))
    np.testing.assert_allclose(millimetres, 1000.0 * read, atol=0.5)


def test_rvl_is_read_as_png_is(depth):
    millimetres = np.rint(1000.0 * depth).astype(np.uint16)
    of_png = decode_depth(compressed("16UC1; compressedDepth png", HEADER + png(millimetres)))
    payload = compressed("16UC1; compressedDepth rvl", HEADER + encode_rvl(millimetres))
    of_rvl = decode_depth(payload)
    assert of_rvl.depth.dtype == np.float32
    np.testing.assert_array_equal(of_rvl.depth, of_png.depth)
    assert (of_rvl.stamp_ns, of_rvl.frame_id) == (STAMP, FRAME)
    stamp_ns, frame, image = depth_png(payload)
    assert (stamp_ns, frame) == (STAMP, FRAME)
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(image))), millimetres)


@pytest.mark.parametrize("encoding", ["16UC1", "mono16"])
@pytest.mark.parametrize("codec", ["; compressedDepth png", "; compressedDepth", ""])
def test_the_first_versions_name_no_codec(depth, encoding, codec):
    millimetres = np.rint(1000.0 * depth).astype(np.uint16)
    read = decode_depth(compressed(encoding + codec, HEADER + png(millimetres)))
    np.testing.assert_allclose(read.depth, depth, atol=0.0006)


def test_another_codec_is_named():
    with pytest.raises(MessageError, match=r"PNG or RVL .*; got format '16UC1; compressedDepth zs"):
        decode_depth(compressed("16UC1; compressedDepth zstd", HEADER + b"0" * 40))
    with pytest.raises(MessageError, match="an RVL image of 2 bytes has no size"):
        decode_depth(compressed("16UC1; compressedDepth rvl", HEADER + b"00"))


def test_damaged_bytes_never_do_more_than_a_message_error(survives_damage, depth):
    survives_damage(decode_depth, encode_depth(depth, STAMP, FRAME))
    survives_damage(decode_depth_raw, encode_depth_raw(depth[:3, :4], STAMP, FRAME))
    rvl = encode_rvl(np.rint(1000.0 * depth[:9]).astype(np.uint16))
    survives_damage(decode_depth, compressed("16UC1; compressedDepth rvl", HEADER + rvl))
