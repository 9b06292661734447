"""Messages of a bag whose file was cut off, or some of whose messages cannot be read."""

import logging

import numpy as np
import pytest

from app.datasets.bag_poses import BagPoses
from app.datasets.dataset import DatasetError
from app.datasets.messages import SENT_ONCE, bag_messages
from app.messages import keys
from app.recording.writing.writer import SessionWriter
from tests.app.messages.robot_messages import odometry, raw_color
from tests.app.recording.conftest import (
    START_NS,
    all_messages,
    with_two_odometries,
    write_bag,
    write_session,
)

ODOMETRY = BagPoses(odometry_child="base_link")


@pytest.mark.parametrize("told", [True, False])
def test_what_is_wrong_with_the_file_is_said_once_and_the_rest_is_read(tmp_path, caplog, told):
    session = write_session(tmp_path)
    path = session.writer.path
    path.write_bytes(path.read_bytes()[:-3000])
    with caplog.at_level(logging.WARNING):
        read = list(bag_messages(path, 0.0, heatmaps=False, told=told))
    assert 0 < len(read) < len(all_messages())
    warned = [text for text in caplog.messages if "the file was not ended" in text]
    assert len(warned) == told


def _raw_bag(folder, lost=(), encoding="rgb8"):
    """Write a bag of raw colour and odometry, and the odometry of a camera that is lost."""
    writer = SessionWriter(folder, "r")
    n = 0
    for time_ns, key, payload in all_messages():
        if key == keys.COLOR:
            one = "yuv422" if n in lost else encoding
            image = raw_color(np.zeros((10, 16, 3), np.uint8), time_ns, one)
            writer.add(keys.COLOR_RAW, image, time_ns, 0.0)
            pose = odometry(time_ns, 1.0, 2.0, 0.0, lost=n in lost)
            writer.add(keys.ODOM, pose, time_ns, 0.0)
            n += 1
        elif key in (keys.DEPTH, keys.CAMERA_INFO):
            writer.add(key, payload, time_ns, 0.0)
    writer.close()
    return folder, n


def test_messages_that_cannot_be_read_are_skipped_and_counted(tmp_path, caplog):
    bag, images = _raw_bag(tmp_path / "bag", lost=(3, 4, 7))
    with caplog.at_level(logging.WARNING):
        read = [m.key for m in bag_messages(bag, 0.0, heatmaps=False, poses=ODOMETRY)]
    assert read.count(keys.COLOR) == read.count(keys.TF) == images - 3
    color, pose = [text for text in caplog.messages if "unreadable" in text]
    assert color == (
        f"{bag}: camera/color/image_raw: 3 skipped as unreadable; the first: an uncompressed "
        "colour image is rgb8, bgr8, rgba8, bgra8, mono8; got encoding 'yuv422'"
    )
    assert pose == (
        f"{bag}: odom: 3 skipped as unreadable; the first: tf 'odom' -> 'base_link': rotation is "
        "not a unit quaternion, its norm is 0"
    )


def test_two_odometries_are_not_mixed_where_the_poses_are_those_of_one(tmp_path):
    bag = write_bag(tmp_path / "bag.mcap", with_two_odometries())
    with pytest.raises(DatasetError, match=r"several topics that end in odom: /visual/odom, /wh"):
        list(bag_messages(bag, 0.0, heatmaps=False, poses=ODOMETRY))
    assert list(bag_messages(bag, 0.0, heatmaps=False))


@pytest.mark.parametrize("key", SENT_ONCE)
def test_what_was_sent_before_the_start_alone_is_sent_at_the_start(tmp_path, key):
    bag = [(f"/{k}", k, t, p) for t, k, p in all_messages() if k not in SENT_ONCE]
    kinds = [k for k in SENT_ONCE if k != key]
    once = [(f"/{k}", k, START_NS + n, p) for k in kinds for n, p in [(1, b"\0\1\0\0")]]
    once += [(f"/{key}", key, START_NS + n, p) for n, p in [(1, b"\0\1\0\0"), (2, b"last")]]
    known = [one for one in [*once, *bag] if one[1] in keys.ROS_TYPES]
    path = write_bag(tmp_path / "bag.mcap", sorted(known, key=lambda one: one[2]))
    read = list(bag_messages(path, 2.0, heatmaps=True))
    assert [one.payload for one in read if one.key == key] == [b"last"]
    assert read[0].at_s == 0.0
    assert {one.key for one in read[:3]} == set(SENT_ONCE)


def test_a_bag_without_a_readable_colour_image_is_refused_at_once(tmp_path):
    bag, _ = _raw_bag(tmp_path / "bag", encoding="yuv422")
    messages = bag_messages(bag, 0.0, heatmaps=False, poses=None)
    with pytest.raises(
        DatasetError, match=r"no message of camera/color/image_raw can be read: .*'yuv422'"
    ):
        next(messages)
