import numpy as np
import pytest

from app.messages import keys
from app.messages.images import encode_camera, encode_color
from app.messages.motion import StampedTransform, encode_transforms
from app.recording.frame_tree import FrameTree
from ippon.camera import PinholeCamera

OPTICAL = "optical"


def tree_of(*moving, fixed=()):
    tree = FrameTree()
    tree.add(
        keys.CAMERA_INFO, encode_camera(PinholeCamera.from_horizontal_fov(4, 3, 1.0), 0, OPTICAL)
    )
    for key, edges in ((keys.TF, moving), (keys.TF_STATIC, fixed)):
        links = [edge.split(">") for edge in edges]
        transforms = [
            StampedTransform(stamp_ns=0, parent=a, child=b, T_parent_child=np.eye(4))
            for a, b in links
        ]
        if transforms:
            tree.add(key, encode_transforms(transforms))
    return tree


MOUNT = ("base_link>link", "link>optical")


@pytest.mark.parametrize(
    ("moving", "world"),
    [
        (("odom>base_link",), "odom"),
        (("map>odom", "odom>base_link"), "map"),
        (("earth>map", "map>odom", "odom>base_link"), "map"),
        (("odom>footprint", "footprint>base_link"), "odom"),
    ],
)
def test_the_world_is_map_or_the_root(moving, world):
    tree = tree_of(*moving, fixed=MOUNT)
    assert tree.problem() == ""
    assert tree.world == world


CALLED_OTHERWISE = (
    "; the base must be called 'base_link': a fixed transform from the frame that it has to "
    "'base_link' belongs into tf_static"
)


@pytest.mark.parametrize(
    ("moving", "fixed", "why", "names"),
    [
        (
            ("odom>base_link",), (), "no way from 'odom' to 'optical': nothing names 'optical'",
            "base_link, odom, and there is no tf_static",
        ),
        (
            ("odom>base_link",), ("map>room", *MOUNT),
            "no way from 'map' to 'base_link': it ends at 'odom'",
            "base_link, link, map, odom, optical, room",
        ),
        (
            ("odom>base_link",), ("link>optical",),
            "no way from 'odom' to 'optical': it ends at 'link'", "base_link, link, odom, optical",
        ),
        ((), MOUNT, "nothing says where 'base_link' is", "base_link, link, optical"),
        (("odom>base",), ("base>optical",), "nothing says where 'base_link' is",
         "base, odom, optical" + CALLED_OTHERWISE),
        (("map>odom", "odom>footprint"), ("footprint>optical",),
         "no way from 'map' to 'base_link': nothing names 'base_link'",
         "footprint, map, odom, optical" + CALLED_OTHERWISE),
        ((), (), "nothing says where 'base_link' is", "no frame, and there is no tf_static"),
    ],
)  # fmt: skip
def test_what_is_missing_is_said_with_the_frames_that_there_are(moving, fixed, why, names):
    assert tree_of(*moving, fixed=fixed).problem() == f"{why}; tf has {names}"


def test_transforms_that_are_not_rigid_are_said_where_they_are_missing():
    tree = tree_of("map>base_link", fixed=("base_link>link",))
    mount = encode_transforms(
        [StampedTransform(stamp_ns=0, parent="link", child=OPTICAL, T_parent_child=np.eye(4))]
    )
    tree.add(keys.TF_STATIC, mount[:-8] + bytes(8))
    problem = tree.problem()
    assert "nothing names 'optical'" in problem
    assert problem.endswith(
        "tf 'link' -> 'optical': rotation is not a unit quaternion, its norm is 0"
    )


def test_images_before_the_first_and_after_the_last_pose_are_counted():
    tree = tree_of(fixed=("base_link>link", f"link>{OPTICAL}"))
    for parent, child, seconds in (("map", "odom", range(12)), ("odom", "base_link", range(3, 9))):
        tree.add_transforms(
            StampedTransform(
                stamp_ns=s * 10**9, parent=parent, child=child, T_parent_child=np.eye(4)
            )
            for s in seconds
        )
    stamps = [s * 10**9 + d for s in range(12) for d in (0, 40_000_000)]
    # 0, 1 and 2 s are too early; 9, 10 and 11 s too late; 8.04 s is near enough to the last pose.
    assert tree.count_unposed(stamps) == 2 * (3 + 3)
    assert FrameTree().count_unposed(stamps) == 0


def image_at(stamp_ns):
    return encode_color(np.zeros((4, 4, 3), np.uint8), stamp_ns, OPTICAL)


@pytest.mark.parametrize(
    ("images_s", "text"),
    [
        ((5.0, 6.0), ""),
        ((1.0, 6.0), ""),
        ((9.04, 9.04), ""),
        ((1.0, 2.5), "the images end 1.50 s before the first pose of 'base_link'"),
        ((9.06, 20.0), "the images begin 0.06 s after the last pose of 'base_link'"),
    ],
)
def test_images_that_no_pose_is_of_the_time_of_are_said(images_s, text):
    tree = tree_of(fixed=MOUNT)
    for second in (4.0, 9.0):
        moved = StampedTransform(
            stamp_ns=round(second * 1e9), parent="odom", child="base_link", T_parent_child=np.eye(4)
        )
        tree.add(keys.TF, encode_transforms([moved]))
    assert tree.problem() == ""
    for second in images_s:
        tree.add(keys.COLOR, image_at(round(second * 1e9)))
    assert text in tree.problem()
    assert bool(text) == bool(tree.problem())


@pytest.mark.parametrize(
    ("moving", "fixed", "lacks"),
    [
        (("odom>base",), ("base>optical",), True),
        (("map>odom", "odom>footprint"), ("footprint>optical",), True),
        (("map>odom", "odom>footprint"), MOUNT, True),
        (("odom>base_link",), (), False),
        ((), MOUNT, False),
        ((), (), False),
    ],
)
def test_a_base_is_lacking_where_the_poses_are_those_of_another_frame(moving, fixed, lacks):
    tree = tree_of(*moving, fixed=fixed)
    assert tree.lacks_base is lacks
    assert tree.problem().endswith(CALLED_OTHERWISE) is lacks
