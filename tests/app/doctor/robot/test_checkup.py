"""A good robot gets good lines; each fault of a bad one is said, with what to do."""

import dataclasses

import numpy as np
import pytest

from app.doctor.robot.alignment import edge_score
from app.doctor.robot.checkup import check_robot, last_frame
from app.doctor.robot.images import check_camera
from app.messages import keys
from app.messages.cdr import encode, header
from app.messages.depth.depth_images import decode_depth, encode_depth
from app.messages.images import decode_color, decompress_color, encode_color
from app.messages.motion import (
    StampedTransform,
    StampedTwist,
    decode_transforms,
    encode_flag,
    encode_transforms,
    encode_twist,
)
from app.nodes.navigator.stream_conversion import NO_MOUNT
from ippon.geometry import base_pose, make_transform
from tests.app.messages.depth.test_depth_images import HEADER, compressed
from tests.app.messages.depth.test_rvl import encode_rvl
from tests.app.messages.robot_messages import odometry

DAY_NS = 86_400_000_000_000


def found(samples, profile=None):
    return {f.what: f for f in check_robot(samples, profile)}


def recoded(payload, function):
    """Return a colour message whose image is changed."""
    message = decode_color(payload)
    return encode_color(
        function(decompress_color(message.encoded)), message.stamp_ns, message.frame_id
    )


def depth_image(payload, encoding, values):
    """Return an uncompressed depth image of other numbers, as a faulty driver writes it."""
    image = decode_depth(payload)
    data = np.ascontiguousarray(values(image.depth))
    return encode(
        "sensor_msgs/msg/Image",
        header=header(image.stamp_ns, image.frame_id),
        height=data.shape[0],
        width=data.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=data.shape[1] * data.itemsize,
        data=data.reshape(-1).view(np.uint8),
    )


@pytest.mark.slow
def test_a_good_robot_is_well(samples, profile):
    twist = StampedTwist(stamp_ns=0, linear_m_s=0.0, yaw_rate_rad_s=0.0)
    for image in list(samples.arrivals[keys.COLOR]):
        for k in range(6):
            said = dataclasses.replace(twist, stamp_ns=image.stamp_ns)
            at_ns = image.at_ns + 60_000_000 + k * 33_000_000
            samples.add(keys.CMD_VEL, encode_twist(said), at_ns)
    lines = found(samples, profile)
    assert {f.verdict for f in lines.values()} == {"ok"}, lines
    assert not any(f.do for f in lines.values())
    assert lines["colour"].detail.startswith("160 x 100, 5.0 Hz")
    assert "unit metres" in lines["depth"].detail
    assert lines["delay"].detail.startswith("30 ms from the stamp")
    assert "60 ms from image to command" in lines["commands"].detail


def test_a_silent_robot(samples):
    samples.arrivals.clear()
    lines = found(samples)
    assert {lines[k].verdict for k in ("colour", "depth", "intrinsics", "tf")} == {"failed"}
    assert "start the driver and the bridge" in lines["colour"].do


def test_the_tilt_of_the_last_frame_is_an_angle(samples, change):
    c, s = np.cos(-0.9), np.sin(-0.9)
    # About the camera's x axis, to the right: down.
    down = make_transform(np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]), (0.0, 0.0, 0.0))

    def tilted(payload):
        *others, last = decode_transforms(payload)
        pose = last.T_parent_child @ down
        return encode_transforms([*others, dataclasses.replace(last, T_parent_child=pose)])

    before = last_frame(samples, check_camera(samples))
    change(keys.TF, tilted)
    frame = last_frame(samples, check_camera(samples))
    assert frame.tilt_rad - before.tilt_rad == pytest.approx(-0.9, abs=1e-3)


def test_depth_compressed_as_rvl(samples, change):
    def rvl(payload):
        image = decode_depth(payload)
        millimetres = np.rint(1000.0 * image.depth[:20, :30]).astype(np.uint16)
        return compressed("16UC1; compressedDepth rvl", HEADER + encode_rvl(millimetres))

    change(keys.DEPTH, rvl)
    line = found(samples)["depth"]
    assert line.detail.startswith("30 x 20,"), line


def test_raw_depth_is_used_where_compressed_depth_cannot_be_read(samples, change):
    for one in list(samples.arrivals[keys.DEPTH]):
        raw = depth_image(one.payload, "16UC1", lambda d: np.rint(1000.0 * d).astype("<u2"))
        samples.add(keys.DEPTH_RAW, raw, one.at_ns)
    change(keys.DEPTH, lambda _: encode_flag(True))
    lines = found(samples)
    assert lines["depth"].verdict == "warning"
    assert "uncompressed; on camera/depth/image_raw/compressedDepth: " in lines["depth"].detail
    assert lines["depth with colour"].verdict == "ok"


@pytest.mark.slow
def test_a_black_camera(samples, change):
    change(keys.COLOR, lambda p: recoded(p, np.zeros_like))
    line = found(samples)["colour"]
    assert line.verdict == "failed"
    assert line.detail.startswith("black: 160 x 100")


def test_a_topic_of_another_type(samples, change):
    change(keys.DEPTH, lambda _: encode_flag(True))
    line = found(samples)["depth"]
    assert line.verdict == "failed"
    assert "not a sensor_msgs/msg/CompressedImage" in line.detail
    assert "name the right one" in line.do


@pytest.mark.slow
@pytest.mark.parametrize(
    ("encoding", "values", "seems"),
    [
        ("32FC1", lambda d: (1000.0 * d).astype("<f4"), "seems to be millimetres"),
        ("16UC1", lambda d: np.rint(d).astype("<u2"), "seems to be metres"),
    ],
)
def test_depth_in_the_wrong_unit(samples, change, encoding, values, seems):
    change(keys.DEPTH, lambda p: depth_image(p, encoding, values), keys.DEPTH_RAW)
    line = found(samples)["depth"]
    assert (line.verdict, seems in line.detail) == ("failed", True), line


@pytest.mark.slow
@pytest.mark.parametrize(("per_m", "wrong"), [(100, "short"), (10_000, "long")])
def test_depth_in_centimetres_or_tenths_of_a_millimetre_is_told_by_the_floor(
    samples, change, profile, per_m, wrong
):
    change(
        keys.DEPTH,
        lambda p: depth_image(p, "16UC1", lambda d: np.rint(per_m * d).astype("<u2")),
        keys.DEPTH_RAW,
    )
    for line in (found(samples)["depth"], found(samples, profile)["profile"]):
        assert line.verdict == "failed"
        assert f"depth is 10 times too {wrong} for a floor 1.20 m below" in line.detail


@pytest.mark.slow
def test_depth_of_a_wall_right_ahead_is_no_wrong_unit(samples, change):
    change(
        keys.DEPTH,
        lambda p: depth_image(p, "32FC1", lambda d: np.full_like(d, 0.4)),
        keys.DEPTH_RAW,
    )
    assert found(samples)["depth"].verdict == "ok"


@pytest.mark.parametrize("width", [424, 480, 640, 720, 848, 1280, 1920])
def test_depth_is_compared_with_colour_at_every_width(width):
    height = width // 2
    depth = np.full((height, width), 3.0, np.float32)
    depth[height // 4 : height // 2, width // 3 : width // 2] = 1.5
    color = np.repeat((60.0 * depth).astype(np.uint8)[:, :, None], 3, axis=2)
    score = edge_score([(color, depth)])
    assert score is not None
    assert score.score > 2.0
    assert score.best < 1.3 * score.score


@pytest.mark.slow
def test_depth_without_returns(samples, change):
    def empty(payload):
        image = decode_depth(payload)
        return encode_depth(0.0 * image.depth, image.stamp_ns, image.frame_id)

    change(keys.DEPTH, empty)
    assert "no pixel has a depth" in found(samples)["depth"].detail


@pytest.mark.slow
def test_depth_of_another_camera(samples, change):
    def moved(payload):
        image = decode_depth(payload)
        return encode_depth(np.roll(image.depth, 6, axis=1), image.stamp_ns, image.frame_id)

    assert found(samples)["depth with colour"].verdict == "ok"
    change(keys.DEPTH, moved)
    line = found(samples)["depth with colour"]
    assert line.verdict == "warning", line
    assert "with depth moved by (-6, " in line.detail


@pytest.mark.slow
def test_depth_of_another_size(samples, change):
    def halved(payload):
        image = decode_depth(payload)
        return encode_depth(image.depth[::2, ::2], image.stamp_ns, image.frame_id)

    change(keys.DEPTH, halved)
    line = found(samples)["intrinsics"]
    assert (line.verdict, "images of 80 x 50" in line.detail) == ("failed", True)


@pytest.mark.slow
def test_no_tf_and_a_frame_that_is_missing(samples, change):
    def renamed(payload):
        return encode_transforms(
            dataclasses.replace(t, parent="odom" if t.parent == "map" else t.parent)
            for t in decode_transforms(payload)
        )

    change(keys.TF, renamed)
    line = found(samples)["tf"]
    assert "no way from 'map' to 'base_link': it ends at 'odom'" in line.detail
    assert "publishes a fixed one from 'map' to 'odom'" in line.do
    del samples.arrivals[keys.TF]
    assert found(samples)["tf"].detail == "nothing comes on tf"


def test_a_transform_that_is_not_rigid_is_said_where_it_is_missing(samples, change):
    # w is the last number of the last transform, which leads to the camera.
    change(keys.TF, lambda payload: payload[:-32] + bytes(32))
    line = found(samples)["tf"]
    assert line.verdict == "failed"
    assert "rotation is not a unit quaternion, its norm is 0" in line.detail


@pytest.fixture
def rename(change):
    """Return a function that changes the child's name in each transform."""

    def rename_children(new_name):
        def renamed(payload):
            return encode_transforms(
                [
                    dataclasses.replace(t, child=new_name(t.child))
                    for t in decode_transforms(payload)
                ]
            )

        change(keys.TF, renamed)

    return rename_children


def test_frames_may_begin_with_a_slash(samples, rename):
    rename(lambda name: "/" + name)
    assert "tf" not in found(samples)


def test_a_frame_of_another_name_is_said_and_a_silent_navigator_is_no_news_then(samples, rename):
    rename(lambda name: "robot_" + name)
    lines = found(samples)
    assert lines["tf"].detail.startswith("no way from 'map' to 'base_link': nothing")
    assert "commands" not in lines


def base_footprint(payload):
    """Return the transforms of a robot whose base is called like that."""
    return encode_transforms(
        dataclasses.replace(
            t,
            parent=t.parent.replace("base_link", "base_footprint"),
            child=t.child.replace("base_link", "base_footprint"),
        )
        for t in decode_transforms(payload)
    )


def test_a_base_of_another_name_is_told_to_publish_ours(samples, change):
    change(keys.TF, base_footprint)
    line = found(samples)["tf"]
    assert "nothing names 'base_link'; there is base_footprint" in line.detail
    assert line.do.startswith("the base must be called 'base_link': publish a fixed transform")


def test_a_base_of_another_name_that_carries_ours_is_well(samples, change):
    """As the guide says: a fixed transform from the robot's base to `base_link`."""

    at_ns = samples.arrivals[keys.TF][0].at_ns
    change(keys.TF, base_footprint)
    ours = StampedTransform(
        stamp_ns=0, parent="base_footprint", child="base_link", T_parent_child=np.eye(4)
    )
    samples.add(keys.TF_STATIC, encode_transforms([ours]), at_ns)
    assert found(samples)["pose"].verdict == "ok"


def test_odometry_takes_the_place_of_tf(samples):
    stamps = [a.at_ns for a in samples.arrivals.pop(keys.TF)]
    for at_ns in stamps:
        samples.add(keys.ODOM, odometry(at_ns, 0.0, 0.0, 0.0), at_ns)
    line = found(samples)["pose"]
    assert (line.verdict, line.detail.startswith("odometry")) == ("ok", True)


def test_odometry_of_a_camera_that_tilts_fails_as_in_the_navigator(samples, profile):
    for one in samples.arrivals.pop(keys.TF):
        samples.add(keys.ODOM, odometry(one.at_ns, 0.0, 0.0, 0.0), one.at_ns)
    line = found(samples, profile)["odometry"]
    assert (line.verdict, line.detail) == ("failed", NO_MOUNT)
    fixed = dataclasses.replace(profile, min_tilt_rad=0.0, max_tilt_rad=0.0)
    assert found(samples, fixed)["pose"].verdict == "ok"


def test_a_camera_whose_pose_is_tracked_needs_no_tf(samples, profile):
    del samples.arrivals[keys.TF]
    held = dataclasses.replace(profile, tracks_pose=True, takes_velocities=False)
    lines = found(samples, held)
    assert "tf" not in lines
    assert lines["pose"].verdict == "warning"
    assert lines["pose"].do.startswith("point the camera at something")
    samples.navigator = False
    assert found(samples, held)["pose"].do == "start `ippon navigate` with this profile"


@pytest.mark.parametrize(
    ("child", "verdict"),
    [("base_link", "ok"), ("base_footprint", "ok"), ("wheel", "failed"), ("mast", "failed")],
)
def test_odometry_of_another_frame_than_the_base_fails(samples, child, verdict):
    stamps = [a.at_ns for a in samples.arrivals.pop(keys.TF)]
    links = [
        StampedTransform(stamp_ns=0, parent=parent, child=name, T_parent_child=np.eye(4))
        for parent, name in (("base_footprint", "base_link"), ("base_link", "mast"))
    ]
    samples.add(keys.TF_STATIC, encode_transforms(links), stamps[0])
    for at_ns in stamps:
        samples.add(keys.ODOM, odometry(at_ns, 0.0, 0.0, 0.0, child), at_ns)
    line = found(samples)["pose" if verdict == "ok" else "odometry"]
    assert line.verdict == verdict
    if verdict == "failed":
        assert f"odometry is the pose of '{child}', and not of 'base_link'" in line.detail


def extra(samples, parent, child):
    first = samples.arrivals[keys.TF][0]
    one = StampedTransform(
        stamp_ns=first.at_ns, parent=parent, child=child, T_parent_child=np.eye(4)
    )
    samples.add(keys.TF, encode_transforms([one]), first.at_ns)


@pytest.mark.slow
def test_two_parents_and_a_loop(samples):
    extra(samples, "odom", "base_link")
    assert "'base_link' has two parents, map and odom" in found(samples)["tf"].detail
    samples.arrivals[keys.TF].pop()
    extra(samples, "base_link", "map")
    assert "a loop: " in found(samples)["tf"].detail


@pytest.mark.slow
def test_a_pose_that_jumps(samples, change):
    steps = iter(range(1000))

    def jump(payload):
        k = next(steps)
        return encode_transforms(
            dataclasses.replace(t, T_parent_child=base_pose(2.0 * (k > 40), 0.0, 0.0, 0.0))
            if t.child == "base_link"
            else t
            for t in decode_transforms(payload)
        )

    change(keys.TF, jump)
    line = found(samples)["pose"]
    assert (line.verdict, "it jumps by 2.0 m" in line.detail) == ("warning", True), line


def test_stamps_a_day_apart(samples, change):
    def older(payload):
        image = decode_depth(payload)
        return encode_depth(image.depth, image.stamp_ns - DAY_NS, image.frame_id)

    change(keys.DEPTH, older)
    lines = found(samples)
    assert "1.0 days older than those of colour" in lines["clock of depth"].detail
    assert lines["depth with colour"].verdict == "failed"
    for several in samples.arrivals.values():
        for one in several:
            one.at_ns += DAY_NS
    line = found(samples)["clock"]
    assert (line.verdict, "1.0 days behind this machine's" in line.detail) == ("warning", True)


def test_clocks_that_the_profile_brings_together_agree(samples, profile, change):
    def later(payload):
        return encode_transforms(
            dataclasses.replace(t, stamp_ns=t.stamp_ns + 800_000_000)
            for t in decode_transforms(payload)
        )

    change(keys.TF, later)
    lines = found(samples)
    assert "0.8 s newer than those of colour" in lines["clock of pose"].detail
    lines = {f.what: f for f in check_robot(samples, profile, 0.8)}
    assert "clock of pose" not in lines
    assert "a pose for 100% of the images" in lines["pose"].detail
    assert lines["profile"].verdict == "ok"


@pytest.mark.slow
def test_stamps_that_stand_still_or_lie_in_the_future(samples):
    for one in samples.arrivals[keys.COLOR]:
        one.at_ns -= 300_000_000
    line = found(samples)["delay"]
    assert (line.verdict, line.detail.startswith("the stamp of a colour image is 2")) == (
        "warning",
        True,
    )
    for one in samples.arrivals[keys.COLOR]:
        one.stamp_ns = samples.arrivals[keys.COLOR][0].stamp_ns
    line = found(samples)["clock"]
    assert line.verdict == "failed"
    assert "the stamps do not advance: 15 colour images have 1 stamps" in line.detail


@pytest.mark.slow
def test_a_profile_of_another_robot(samples, profile):
    other = dataclasses.replace(profile, camera_height_m=0.6)
    line = found(samples, other)["profile"]
    assert line.verdict == "failed"
    assert "1.20 m above the base, the profile says 0.60 m" in line.detail


def test_a_mount_that_the_navigator_assumes_is_not_compared(samples, profile):
    samples.is_mount_assumed = True
    line = found(samples, profile)["profile"]
    assert line.verdict == "ok"
    assert "height, place and tilt are not compared" in line.detail


@pytest.mark.slow
def test_commands_that_reach_nobody_two_bridges_and_a_silent_navigator(samples, profile):
    line = found(samples)["commands"]
    assert (line.verdict, "the navigator is silent" in line.detail) == ("warning", True)
    samples.takes_velocities = False
    assert found(samples)["commands"].detail == "nobody listens to cmd_vel"
    samples.bridges = ("r/alive/ros2/1-a-7", "r/alive/ros2/2-b-8")
    assert "two bridges serve this robot: 1-a-7 and 2-b-8" in found(samples)["bridge"].detail
    goals = dataclasses.replace(profile, takes_goals=True, takes_velocities=False)
    assert found(samples, goals)["commands"].detail == "nobody listens to navigation/goal"


def test_velocities_that_a_robot_with_goals_does_not_take_are_a_warning(samples, profile):
    samples.takes_goals, samples.takes_velocities = True, False
    both = dataclasses.replace(profile, takes_goals=True, takes_velocities=True)
    line = found(samples, both)["driving by hand"]
    assert (line.verdict, line.detail) == ("warning", "nobody listens to cmd_vel")
    goals = dataclasses.replace(both, takes_velocities=False)
    assert "driving by hand" not in found(samples, goals)


def test_the_clock_of_odometry_does_not_count_where_tf_comes(samples):
    for one in list(samples.arrivals[keys.TF]):
        for _ in range(3):
            samples.add(keys.ODOM, odometry(one.at_ns - DAY_NS, 0.0, 0.0, 0.0), one.at_ns)
    assert "clock of pose" not in found(samples)
    del samples.arrivals[keys.TF]
    assert "24.0 hours older" in found(samples)["clock of pose"].detail


def test_a_console_or_recorder_is_no_robot_that_takes_commands(samples):
    samples.onlookers = True
    line = found(samples)["commands"]
    assert line.verdict == "warning"
    assert line.detail.startswith("it is not known whether the robot listens to cmd_vel")
    samples.bridges = ("r/alive/ros2/1-a-7",)
    assert "the navigator is silent" in found(samples)["commands"].detail
    samples.bridges, samples.simulated = (), True
    assert "the navigator is silent" in found(samples)["commands"].detail
