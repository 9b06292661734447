import math

import numpy as np
import pytest

from app.links.robot_streams.transforms import HISTORY, MAX_FRAMES, TransformBuffer
from app.messages.cdr import MessageError
from app.messages.motion import StampedTransform
from ippon.geometry import base_pose, yaw_of

SECOND = 1_000_000_000


def stamped(stamp_ns, x, yaw=0.0, *, parent="map", child="base_link"):
    return StampedTransform(
        stamp_ns=stamp_ns, parent=parent, child=child, T_parent_child=base_pose(x, 0.0, 0.0, yaw)
    )


def test_the_exact_stamp():
    buffer = TransformBuffer()
    for k in range(5):
        buffer.add(stamped(k * SECOND, float(k)))
    assert buffer.lookup("map", "base_link", 3 * SECOND)[0, 3] == 3.0


@pytest.mark.parametrize("w", [0.1, 0.5, 0.9])
def test_between_two_stamps(w):
    buffer = TransformBuffer()
    # Across the seam of the angle: the short way round.
    buffer.add(stamped(0, 1.0, math.pi - 0.2))
    buffer.add(stamped(SECOND, 2.0, -math.pi + 0.2))
    T = buffer.lookup("map", "base_link", round(w * SECOND))
    assert T[0, 3] == pytest.approx(1.0 + w)
    expected = math.pi - 0.2 + 0.4 * w
    assert math.cos(yaw_of(T) - expected) == pytest.approx(1.0)


def test_beyond_the_newest_only_within_the_tolerance():
    buffer = TransformBuffer(tolerance_s=0.05)
    buffer.add(stamped(SECOND, 1.0))
    assert buffer.lookup("map", "base_link", SECOND + 40_000_000) is not None
    assert buffer.lookup("map", "base_link", SECOND + 60_000_000) is None
    assert buffer.lookup("map", "base_link", SECOND - 60_000_000) is None


def test_between_poses_in_two_frames_there_is_none():
    """Two nodes that publish one frame under different parents: a mean of both is nowhere."""
    buffer = TransformBuffer()
    buffer.add(stamped(0, 0.0))
    buffer.add(stamped(20_000_000, 10.0, parent="odom"))
    assert buffer.lookup("map", "base_link", 10_000_000) is None
    assert buffer.lookup("map", "base_link", 0)[0, 3] == 0.0


def test_a_chain_of_moving_and_fixed_frames():
    buffer = TransformBuffer()
    buffer.add(stamped(0, 1.0, math.pi / 2))
    buffer.add(stamped(0, 0.5, parent="base_link", child="mast"), fixed=True)
    buffer.add(stamped(0, 0.2, parent="mast", child="camera"), fixed=True)
    T = buffer.lookup("map", "camera", 0)
    np.testing.assert_allclose(T[:3, 3], [1.0, 0.7, 0.0], atol=1e-12)


def test_unknown_frames_and_loops_have_no_pose():
    buffer = TransformBuffer()
    assert buffer.lookup("map", "camera", 0) is None
    buffer.add(stamped(0, 0.0, parent="a", child="b"), fixed=True)
    buffer.add(stamped(0, 0.0, parent="b", child="a"), fixed=True)
    assert buffer.lookup("map", "a", 0) is None


def test_history_is_bounded():
    buffer = TransformBuffer()
    for k in range(3 * HISTORY):
        buffer.add(stamped(k * SECOND, float(k)))
    assert buffer.lookup("map", "base_link", HISTORY * SECOND) is None
    assert buffer.lookup("map", "base_link", (3 * HISTORY - 1) * SECOND) is not None


def test_a_clock_that_starts_anew_and_one_that_stumbles():
    buffer = TransformBuffer()
    for k in range(20):
        buffer.add(stamped(k * SECOND // 10, float(k)))
    buffer.add(stamped(19 * SECOND // 10 - 1, -1.0))
    assert buffer.lookup("map", "base_link", 18 * SECOND // 10)[0, 3] == 18.0
    buffer.add(stamped(SECOND // 10, 7.0))
    assert buffer.lookup("map", "base_link", SECOND // 10)[0, 3] == 7.0
    assert buffer.lookup("map", "base_link", 18 * SECOND // 10) is None


def test_made_up_frames_do_not_grow_memory():
    buffer = TransformBuffer()
    for k in range(MAX_FRAMES):
        buffer.add(stamped(0, 0.0, child=f"ghost{k}"))
    with pytest.raises(MessageError, match=f"more than {MAX_FRAMES} coordinate frames"):
        buffer.add(stamped(0, 1.0, child="one too many"))
    buffer.add(stamped(SECOND, 1.0, child="ghost0"))
    assert buffer.lookup("map", "ghost0", SECOND)[0, 3] == 1.0
