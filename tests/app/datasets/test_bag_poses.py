"""Where the poses of a bag come from, by its first messages."""

from pathlib import Path

import numpy as np
import pytest

from app.datasets.bag_poses import poses_of
from app.datasets.dataset import DatasetError
from app.messages import keys
from app.messages.images import encode_camera, encode_color
from app.messages.motion import StampedTransform, decode_transforms, encode_transforms
from ippon.camera import PinholeCamera
from tests.app.messages.robot_messages import odometry

BAG, OPTICAL = Path("bag"), "optical"
MOUNT = np.eye(4)
MOUNT[2, 3] = 1.0
INFO = (
    keys.CAMERA_INFO,
    encode_camera(PinholeCamera.from_horizontal_fov(4, 3, 1.0), 0, OPTICAL),
)
IMAGE = (keys.COLOR, encode_color(np.zeros((3, 4, 3), np.uint8), 0, OPTICAL))


def tf(parent, child, key=keys.TF):
    link = StampedTransform(stamp_ns=0, parent=parent, child=child, T_parent_child=np.eye(4))
    return key, encode_transforms([link])


BASE = [tf("map", "odom"), tf("odom", "base_link")]


@pytest.mark.parametrize(
    "more", [[], [(keys.ODOM, odometry(0, 1.0, 2.0, 0.0))]], ids=["tf alone", "odometry, too"]
)
def test_the_mount_of_a_profile_counts_where_tf_gives_the_base_alone(more):
    poses = poses_of(BAG, [INFO, *BASE, *more, IMAGE], MOUNT)
    assert (poses.world, poses.odometry_child, poses.camera_frame) == ("map", "", OPTICAL)
    (link,) = decode_transforms(poses.fixed())
    assert (link.parent, link.child) == ("base_link", OPTICAL)
    np.testing.assert_array_equal(link.T_parent_child, MOUNT)
    assert poses.note(BAG) == "bag: where the camera is on the base is taken from the profile"


def test_a_mount_in_tf_static_is_taken_before_that_of_the_profile():
    fixed = tf("base_link", OPTICAL, keys.TF_STATIC)
    assert poses_of(BAG, [INFO, *BASE, fixed, IMAGE], MOUNT).camera_frame == ""


def test_without_a_mount_a_bag_whose_tf_gives_the_base_is_told_of_the_profile():
    with pytest.raises(DatasetError, match=r"tf says where the base is; --profile FILE with a fix"):
        poses_of(BAG, [INFO, *BASE, IMAGE], None)


def test_a_missing_mount_is_noticed_where_an_image_comes_before_camera_info():
    assert poses_of(BAG, [*BASE, IMAGE, INFO, IMAGE], MOUNT).camera_frame == OPTICAL
    with pytest.raises(DatasetError, match="no way from 'map' to 'optical'"):
        poses_of(BAG, [*BASE, IMAGE, INFO, IMAGE], None)
