"""The compact form of a heatmap: smaller, and refused where it is damaged."""

import numpy as np
import pytest
import zstandard

from app.messages.cdr import MessageError
from app.messages.perception.heatmaps import decode_heatmap, encode_heatmap, pack_top, unpack
from ippon.observation import Heatmap


@pytest.fixture
def heatmap():
    rng = np.random.default_rng(4)
    p = rng.multinomial(255, rng.dirichlet(np.full(41, 0.1)), size=(12, 16)).astype(np.uint8)
    return Heatmap(labels=tuple(f"label_{k}" for k in range(40)), ooi="hat", probabilities=p)


def test_the_compact_form_is_smaller_and_keeps_what_is_likely(heatmap):
    whole = encode_heatmap(heatmap, 5, "camera")
    compact = encode_heatmap(heatmap, 5, "camera", keep=4)
    assert len(compact) < len(whole)
    back = decode_heatmap(compact)
    assert (back.stamp_ns, back.heatmap.ooi) == (5, "hat")
    p, q = back.heatmap.probabilities, heatmap.probabilities
    np.testing.assert_array_equal(p[..., -1], q[..., -1])
    np.testing.assert_array_equal(p.max(axis=2), q.max(axis=2))


def test_further_objects_of_interest_are_kept_in_addition(heatmap):
    also = ("label_7", "label_3", "unknown")
    compact = encode_heatmap(heatmap, 5, "camera", keep=4, also=also)
    p, q = decode_heatmap(compact).heatmap.probabilities, heatmap.probabilities
    for channel in (-1, 7, 3):
        np.testing.assert_array_equal(p[..., channel], q[..., channel])
    np.testing.assert_array_equal(p.max(axis=2), q.max(axis=2))


def test_more_than_256_labels_fit():
    p = np.zeros((2, 2, 300), np.uint8)
    p[..., 299] = 255
    back = unpack("top-zstd", np.frombuffer(pack_top(p, 2, ()), np.uint8), p.shape)
    np.testing.assert_array_equal(back, p)


@pytest.mark.parametrize(
    ("plain", "said"),
    [
        (b"", "do not unpack to 24 to 72 bytes"),
        (bytes(25), "25 bytes, no multiple of 24"),
        (bytes(96), "do not unpack to 24 to 72 bytes"),
        (bytes([9] * 12 + [0] * 12), "heatmap data name channel 9 of 3"),
    ],
)
def test_damaged_data_are_refused(plain, said):
    packed = np.frombuffer(zstandard.ZstdCompressor().compress(plain), np.uint8)
    with pytest.raises(MessageError, match=said):
        unpack("top-zstd", packed, (3, 4, 3))


def test_what_is_not_compressed_at_all_is_refused():
    with pytest.raises(MessageError, match="damaged heatmap data"):
        unpack("top-zstd", np.arange(9, dtype=np.uint8), (3, 4, 3))
