"""RVL against an encoder written here from the paper, bit by bit."""

import struct
from contextlib import suppress

import numpy as np
import pytest

from app.messages.cdr import MessageError
from app.messages.depth.rvl import decode_rvl


def groups_of(number):
    """Return the groups of four bits of a number: three of it, and whether more follow."""
    text = ""
    while True:
        number, low = divmod(number, 8)
        text += f"{low + (8 if number else 0):04b}"
        if not number:
            return text


def encode_rvl(image):
    """Compress an image as the paper's listing does, one pixel after another."""
    pixels, before, bits, at = [int(x) for x in image.ravel()], 0, "", 0
    while at < len(pixels):
        run = next((k for k in range(at, len(pixels)) if pixels[k]), len(pixels))
        bits += groups_of(run - at)
        at = run
        run = next((k for k in range(at, len(pixels)) if not pixels[k]), len(pixels))
        bits += groups_of(run - at)
        for pixel in pixels[at:run]:
            step, before = pixel - before, pixel
            bits += groups_of(2 * step if step >= 0 else -2 * step - 1)
        at = run
    bits += "0" * (-len(bits) % 32)
    words = [int(bits[k : k + 32], 2) for k in range(0, len(bits), 32)]
    return struct.pack(f"<II{len(words)}I", image.shape[1], image.shape[0], *words)


def random_image(seed, shape=(23, 31)):
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 2 ** rng.integers(1, 17), shape).astype(np.uint16)
    image[rng.random(shape) < rng.random()] = 0
    return image


def test_an_image_worked_out_by_hand():
    # Two zeros; one pixel; its difference 5 is folded to 10 = 1 * 8 + 2: groups 2, 1, 8 + 2, 1.
    data = struct.pack("<II", 3, 1) + bytes.fromhex("0000a121")
    np.testing.assert_array_equal(decode_rvl(data), [[0, 0, 5]])


@pytest.mark.parametrize("seed", range(20))
def test_an_image_is_the_one_that_was_encoded(seed):
    image = random_image(seed)
    decoded = decode_rvl(encode_rvl(image))
    assert decoded.dtype == np.uint16
    np.testing.assert_array_equal(decoded, image)


@pytest.mark.parametrize("value", [0, 1, 65535])
def test_an_image_of_one_value(value):
    image = np.full((48, 64), value, np.uint16)
    np.testing.assert_array_equal(decode_rvl(encode_rvl(image)), image)


def test_steps_from_end_to_end_of_the_range():
    image = np.array([[1, 65535, 1, 0, 65535, 32768, 32767, 1]], np.uint16)
    np.testing.assert_array_equal(decode_rvl(encode_rvl(image)), image)


def test_a_cut_image_is_refused():
    data = encode_rvl(random_image(1))
    for length in range(0, len(data) - 4, 41):
        with pytest.raises(MessageError, match=r"has no size|does not hold 31x23 pixels"):
            decode_rvl(data[:length])


@pytest.mark.parametrize("seed", range(50))
def test_damaged_words_are_refused_or_read(seed):
    rng = np.random.default_rng(seed)
    data = bytearray(encode_rvl(random_image(2)))
    for at in rng.integers(8, len(data), 5):
        data[at] = rng.integers(256)
    with suppress(MessageError):
        assert decode_rvl(bytes(data)).shape == (23, 31)


def test_a_number_without_an_end_and_a_huge_image_are_refused():
    with pytest.raises(MessageError, match="a number of 36 bits"):
        decode_rvl(struct.pack("<II2I", 4, 4, 0xFFFFFFFF, 0xFFF00000))
    with pytest.raises(MessageError, match="100000x100000 pixels is not accepted"):
        decode_rvl(struct.pack("<IIi", 100_000, 100_000, 0))
    with pytest.raises(MessageError, match="0x4 pixels is not accepted"):
        decode_rvl(struct.pack("<II", 0, 4))
