import numpy as np
import pytest

from app.messages.cdr import encode, header
from app.messages.depth.depth_images import decode_depth, decode_depth_raw, encode_depth_raw
from app.ros2.ippon_ros2.depth_png import compress_depth


def image(depth_mm, *, frame="depth", encoding="16UC1", step=None, big=0):
    height, width = depth_mm.shape
    step = step or 2 * width
    rows = np.zeros((height, step), np.uint8)
    rows[:, : 2 * width] = depth_mm.astype("<u2").view(np.uint8)
    return encode(
        "sensor_msgs/msg/Image", header=header(12_345_678_901, frame), height=height, width=width,
        encoding=encoding, is_bigendian=big, step=step, data=rows.reshape(-1),
    )  # fmt: skip


@pytest.mark.parametrize("frame", ["", "a", "ab", "abc", "camera_depth_optical_frame"])
@pytest.mark.parametrize("width", [1, 3, 64])
def test_what_is_compressed_is_read_without_loss(frame, width):
    depth_mm = np.random.default_rng(width).integers(0, 65536, (7, width), dtype=np.uint16)
    for padding in (0, 6):
        payload = image(depth_mm, frame=frame, step=2 * width + padding)
        before, after = decode_depth_raw(payload), decode_depth(compress_depth(payload))
        np.testing.assert_array_equal(after.depth, before.depth)
        assert (after.stamp_ns, after.frame_id) == (before.stamp_ns, frame)


def test_a_smooth_image_becomes_much_smaller():
    v, u = np.mgrid[:480, :640]
    depth = (1.0 + 0.002 * u + 0.001 * v).astype(np.float32)
    payload = encode_depth_raw(depth, 5, "eye")
    assert len(compress_depth(payload)) < 0.1 * len(payload)


def test_other_types_are_carried_as_they_are():
    depth_mm = np.ones((4, 4), np.uint16)
    assert compress_depth(image(depth_mm, encoding="bayer_rggb16")) is None
    assert compress_depth(image(depth_mm, big=1)) is None
    assert compress_depth(b"\0\0" + bytes(100)) is None


def test_damaged_images_are_refused():
    payload = image(np.ones((40, 40), np.uint16))
    for cut in (8, 20, 60, len(payload) - 1000):
        with pytest.raises(ValueError, match=r"image|Image"):
            compress_depth(payload[:cut])
