import numpy as np
import pytest

from app.messages.cdr import MessageError
from app.messages.motion import StampedTransform
from app.nodes.navigator.localization.odometry_frame import OdometryFrame
from ippon.geometry import make_transform


def link(parent, child, z):
    T = make_transform(np.eye(3), (0.0, 0.0, z))
    return StampedTransform(stamp_ns=1, parent=parent, child=child, T_parent_child=T)


@pytest.mark.parametrize("child", ["", "base_link", "base_footprint", "odom_child"])
def test_without_fixed_transforms_each_frame_but_that_of_the_camera_is_the_base(child):
    frame = OdometryFrame()
    np.testing.assert_array_equal(frame.base_in(child, "optical"), np.eye(4))
    with pytest.raises(MessageError, match="odometry is the pose of 'optical', and not of 'base_"):
        frame.base_in("optical", "optical")


def test_the_base_hangs_on_the_frame_by_fixed_transforms():
    frame = OdometryFrame()
    frame.add_fixed([link("base_footprint", "chassis", 0.1), link("chassis", "base_link", 0.2)])
    frame.add_fixed([link("base_link", "mast", 1.0)])
    assert frame.base_in("base_footprint", "optical")[2, 3] == pytest.approx(0.3)
    assert frame.base_in("", "optical")[2, 3] == 0.0
    for other in ("mast", "unknown"):
        with pytest.raises(MessageError, match=f"is the pose of '{other}'"):
            frame.base_in(other, "optical")
