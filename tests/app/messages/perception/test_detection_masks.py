"""Masks beside a detector's boxes, as one image of numbers."""

import io

import numpy as np
import pytest
from PIL import Image

from app.messages.cdr import MessageError, encode, header
from app.messages.perception.detection_masks import (
    LONGEST_PX,
    decode_masks,
    decode_masks_compressed,
    encode_masks,
    masks_of,
)
from app.messages.perception.detections import decode_detections, encode_detections
from ippon.observation import Detections, Instance

SIZE = (48, 64)


def seen(*masks):
    return Detections(
        source="x", labels=("cup",), ooi=None, image_size=SIZE,
        instances=tuple(
            Instance(label="cup", score=0.9 - 0.1 * n, box_px=(0.0, 0.0, 64.0, 48.0), mask=mask)
            for n, mask in enumerate(masks)
        ),
    )  # fmt: skip


def rectangle(left, top, right, bottom, size=SIZE):
    mask = np.zeros(size, np.bool_)
    mask[top:bottom, left:right] = True
    return mask


def raw(pixels, encoding):
    return encode(
        "sensor_msgs/msg/Image", header=header(7, "cam"), height=pixels.shape[0],
        width=pixels.shape[1], encoding=encoding, is_bigendian=0,
        step=pixels.shape[1] * pixels.itemsize, data=np.frombuffer(pixels.tobytes(), np.uint8),
    )  # fmt: skip


def compressed(data, kind="png"):
    return encode(
        "sensor_msgs/msg/CompressedImage", header=header(7, "cam"), format=kind,
        data=np.frombuffer(data, np.uint8),
    )  # fmt: skip


def boxes_of(observation):
    return decode_detections(encode_detections(observation, 7, "cam"))


def test_masks_come_back_and_what_lies_on_something_has_the_pixels():
    table, cup = rectangle(0, 10, 60, 40), rectangle(20, 20, 30, 30)
    sent = seen(table, cup, None)
    masks = decode_masks_compressed(encode_masks(sent, 7, "cam"))
    assert masks.stamp_ns == 7
    first, second, third = masks_of(masks, boxes_of(sent), SIZE)
    np.testing.assert_array_equal(first, table & ~cup)
    np.testing.assert_array_equal(second, cup)
    assert third is None


def test_without_masks_there_is_no_message():
    assert encode_masks(seen(None, None), 7, "cam") is None
    assert encode_masks(seen(), 7, "cam") is None
    with pytest.raises(ValueError, match="one size"):
        encode_masks(seen(rectangle(0, 0, 9, 9), rectangle(0, 0, 9, 9, (24, 32))), 7, "cam")


@pytest.mark.parametrize(("encoding", "dtype"), [("mono8", "u1"), ("16UC1", "<u2")])
def test_uncompressed_masks(encoding, dtype):
    numbers = np.zeros(SIZE, dtype)
    numbers[5:9, 6:12] = 1
    masks = decode_masks(raw(numbers, encoding))
    (only,) = masks_of(masks, boxes_of(seen(None)), SIZE)
    np.testing.assert_array_equal(only, numbers == 1)


def test_large_masks_are_thinned_and_small_ones_fit():
    boxes = boxes_of(seen(None))
    large = decode_masks(raw(np.ones((960, 1280), np.uint8), "mono8"))
    (only,) = masks_of(large, boxes, (960, 1280))
    assert max(only.shape) <= LONGEST_PX
    small = decode_masks(raw(np.ones((12, 16), np.uint8), "mono8"))
    assert masks_of(small, boxes, SIZE)[0].all()


def test_masks_that_contradict_their_boxes():
    boxes = boxes_of(seen(None))
    with pytest.raises(MessageError, match="not in proportion to the image of 64x48"):
        masks_of(decode_masks(raw(np.ones((48, 48), np.uint8), "mono8")), boxes, SIZE)
    with pytest.raises(MessageError, match="number detection 2, and there are 1"):
        masks_of(decode_masks(raw(np.full(SIZE, 2, np.uint8), "mono8")), boxes, SIZE)


def test_images_that_are_no_masks():
    with pytest.raises(MessageError, match="got encoding 'rgb8'"):
        decode_masks(raw(np.zeros((48, 192), np.uint8), "rgb8"))
    out = io.BytesIO()
    Image.fromarray(np.zeros(SIZE, np.uint8)).save(out, "JPEG")
    with pytest.raises(MessageError, match="masks are compressed as PNG"):
        decode_masks_compressed(compressed(out.getvalue(), "jpeg"))
    out = io.BytesIO()
    Image.fromarray(np.zeros((*SIZE, 3), np.uint8)).save(out, "PNG")
    with pytest.raises(MessageError, match="grey PNG"):
        decode_masks_compressed(compressed(out.getvalue()))


def test_damaged_bytes_never_do_more_than_a_message_error(survives_damage):
    survives_damage(decode_masks_compressed, encode_masks(seen(rectangle(3, 3, 9, 9)), 7, "cam"))
    survives_damage(decode_masks, raw(np.ones((6, 8), np.uint8), "mono8"))
