"""RVL, the lossless compression of 16-bit depth (Wilson, ISS 2017).

It is the other codec of `compressedDepth`, beside PNG. An image is a sequence of runs in row-major
order: a number of zeros, a number of other pixels, and the difference of each of these from the one
before it. Each number is written in groups of four bits, lowest first: three of the number, and one
that says that more follow. Eight groups make a word of 32 bits, highest first.
"""

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.messages.cdr import MessageError
from app.messages.images import check_size

_SIZE: Final = struct.Struct("<II")
_MOST_GROUPS: Final = 9
"""Of one number: 27 bits, more than the largest image that is accepted has pixels."""
_SHIFTS: Final = np.arange(28, -1, -4, dtype=np.uint32)


def decode_rvl(data: bytes) -> NDArray[np.uint16]:
    """Decompress an image.

    Args:
        data: Width and height (uint32, little-endian), and the words.

    Returns:
        (H, W) uint16.

    Raises:
        MessageError: Damaged, cut, or more pixels than are accepted.
    """
    if len(data) < _SIZE.size:
        raise MessageError(f"an RVL image of {len(data)} bytes has no size")
    width, height = _SIZE.unpack_from(data)
    check_size(width, height)
    numbers = _numbers(data[_SIZE.size :])
    out = np.zeros(width * height, np.uint16)
    is_return, is_difference = np.zeros(len(out), bool), np.zeros(len(numbers), bool)
    pixel = at = 0
    while pixel < len(out):
        zeros, others = (
            (numbers.item(at), numbers.item(at + 1)) if at + 1 < len(numbers) else (0, 0)
        )
        pixel, at = pixel + zeros, at + 2
        if pixel + others > len(out) or at + others > len(numbers):
            raise MessageError(
                f"a damaged RVL image of {len(data)} bytes: it does not hold {width}x{height} "
                "pixels"
            )
        is_return[pixel : pixel + others] = True
        is_difference[at : at + others] = True
        pixel, at = pixel + others, at + others
    folded = numbers[is_difference]
    # Even numbers stand for differences from 0 up, odd ones for those below.
    differences = (folded >> 1) ^ -(folded & 1)
    out[is_return] = np.cumsum(differences).astype(np.uint16)
    return out.reshape(height, width)


def _numbers(data: bytes) -> NDArray[np.int64]:
    """Return (N,) the numbers of the words."""
    words = np.frombuffer(data[: len(data) // 4 * 4], "<u4")
    groups = ((words[:, None] >> _SHIFTS) & 0xF).astype(np.uint8).ravel()
    ends = np.flatnonzero(groups < 8)
    if len(ends) == 0:
        return np.zeros(0, np.int64)
    starts = np.concatenate(([0], ends[:-1] + 1))
    lengths = ends + 1 - starts
    if lengths.max() > _MOST_GROUPS:
        raise MessageError(f"a damaged RVL image: a number of {3 * lengths.max()} bits")
    numbers = (groups[starts] & 7).astype(np.int64)
    for k in range(1, lengths.max()):
        longer = np.flatnonzero(lengths > k)
        numbers[longer] |= (groups[starts[longer] + k] & 7).astype(np.int64) << (3 * k)
    return numbers
