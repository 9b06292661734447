import numpy as np
import pytest

from app.messages import keys
from app.messages.depth.depth_images import encode_depth
from app.messages.images import encode_color
from app.recording.depth_pairs import DepthPairs


@pytest.mark.parametrize(
    ("depth_every", "late_ms", "alone"),
    [(1, 0, 0), (1, 19, 0), (1, 30, 40), (2, 0, 20), (99, 0, 39)],
)
def test_colour_images_without_depth_are_counted(depth_every, late_ms, alone):
    pairs = DepthPairs()
    for n in range(40):
        stamp_ns = n * 100_000_000
        pairs.add(keys.COLOR, encode_color(np.zeros((4, 4, 3), np.uint8), stamp_ns, "x"))
        if n % depth_every == 0:
            depth = np.ones((4, 4), np.float32)
            pairs.add(keys.DEPTH, encode_depth(depth, stamp_ns + late_ms * 1_000_000, "x"))
    problem = pairs.problem()
    assert (
        problem.startswith(f"{alone} of 40 colour images have no depth") if alone else not problem
    )
