"""Masks of a detector's boxes, as one image.

A pixel with value k belongs to detection k, counted from 1, of the message with the same stamp; 0
belongs to no detection.
"""

import io
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image as PillowImage

from app.messages.cdr import MessageError, decode, encode, header, stamp_ns_of
from app.messages.images import GREY_16, image_rows, read_png
from app.messages.perception.detections import StampedBoxes
from ippon.observation import Detections

LONGEST_PX: Final = 320
"""Masks are subsampled to this many pixels along the longer side: twice the map's resolution."""
_COMPRESSED: Final = "sensor_msgs/msg/CompressedImage"
_IMAGE: Final = "sensor_msgs/msg/Image"
_DTYPES: Final = {"mono8": "u1", "8UC1": "u1", "mono16": "u2", "16UC1": "u2"}
_MODES: Final = GREY_16 | {"L"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StampedMasks:
    """Detection of each pixel."""

    stamp_ns: int
    frame_id: str
    numbers: NDArray[np.uint16]
    """(h, w) in proportion to the image; 0 belongs to no detection."""


def encode_masks(detections: Detections, stamp_ns: int, frame_id: str) -> bytes | None:
    """Write the masks of an image's instances as a grey PNG; None if no instance has one.

    Where masks overlap, the pixel belongs to the smaller one, which is usually in front.

    Raises:
        ValueError: The masks differ in size.
    """
    masks = [(n, one.mask) for n, one in enumerate(detections.instances, start=1)]
    known = [(n, mask) for n, mask in masks if mask is not None]
    if not known:
        return None
    shapes = {mask.shape for _, mask in known}
    if len(shapes) > 1:
        raise ValueError(f"the masks of an image are of one size; got {sorted(shapes)}")
    narrow = len(masks) <= np.iinfo(np.uint8).max
    numbers = np.zeros(next(iter(shapes)), np.uint8 if narrow else np.uint16)
    for n, mask in sorted(known, key=lambda item: -np.count_nonzero(item[1])):
        numbers[mask] = n
    out = io.BytesIO()
    PillowImage.fromarray(numbers).save(out, "PNG", compress_level=1)
    return encode(
        _COMPRESSED,
        header=header(stamp_ns, frame_id),
        format=f"{'mono8' if narrow else 'mono16'}; png compressed ",
        data=np.frombuffer(out.getvalue(), np.uint8),
    )


def decode_masks(payload: bytes) -> StampedMasks:
    """Read masks from an Image: mono8, 8UC1, mono16 or 16UC1.

    Raises:
        MessageError: Not such a message, of another encoding, or sizes that contradict each other.
    """
    message = decode(payload, _IMAGE)
    if message.encoding not in _DTYPES:
        raise MessageError(
            f"masks are numbers of detections, {', '.join(_DTYPES)}; got encoding "
            f"{message.encoding[:40]!r}"
        )
    order = ">" if message.is_bigendian else "<"
    numbers = image_rows(message, np.dtype(order + _DTYPES[message.encoding]))
    return StampedMasks(
        stamp_ns=stamp_ns_of(message.header),
        frame_id=message.header.frame_id,
        numbers=numbers.astype(np.uint16),
    )


def decode_masks_compressed(payload: bytes) -> StampedMasks:
    """Read masks from a CompressedImage: a grey PNG of 8 or 16 bits.

    Raises:
        MessageError: Not such a message, damaged, or no grey PNG: JPEG would change the numbers.
    """
    message = decode(payload, _COMPRESSED)
    data = message.data.tobytes()
    if not data.startswith(b"\x89PNG"):
        raise MessageError(
            f"masks are compressed as PNG; got format {message.format[:40]!r} with {len(data)} "
            "bytes"
        )
    numbers = read_png(data, modes=_MODES, expected="masks are a grey PNG of 8 or 16 bits")
    return StampedMasks(
        stamp_ns=stamp_ns_of(message.header),
        frame_id=message.header.frame_id,
        numbers=numbers.astype(np.uint16),
    )


def masks_of(
    masks: StampedMasks, boxes: StampedBoxes, image_size: tuple[int, int]
) -> list[NDArray[np.bool_] | None]:
    """Return the mask of each row of `boxes`; None for a detection that has no pixel.

    Args:
        masks: Masks of the same image.
        boxes: Boxes of the same image.
        image_size: (H, W) pixels of the image.

    Returns:
        Masks over the whole image, subsampled to `LONGEST_PX`.

    Raises:
        MessageError: The masks are not in proportion to the image, or refer to an unknown
            detection.
    """
    (h, w), (height, width) = masks.numbers.shape, image_size
    # Sizes are whole pixels, so a proportional size differs by less than one per side.
    if abs(h * width - w * height) >= max(width, height):
        raise MessageError(
            f"masks of {w}x{h} pixels are not in proportion to the image of {width}x{height}: "
            "publish them in its size, or scaled down with it"
        )
    most = int(masks.numbers.max(initial=0))
    if most > boxes.count:
        raise MessageError(
            f"masks number detection {most}, and there are {boxes.count}: a pixel holds the number "
            "of its detection in the message with the same stamp, counted from 1, or 0"
        )
    step = -(-max(h, w) // LONGEST_PX)
    thinned = masks.numbers[step // 2 :: step, step // 2 :: step]
    present = set(np.unique(thinned).tolist())
    split = {n: thinned == n for n in set(boxes.numbers.tolist()) & present}
    return [split.get(n) for n in boxes.numbers.tolist()]
