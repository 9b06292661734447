"""The streams of a bag get the same lines as those of a live robot."""

import dataclasses
import json

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from app.cli.main import run
from app.datasets.bag_robot import BagRobot
from app.doctor.robot.recorded import check_bag
from app.messages import keys
from app.messages.cdr import typestore
from app.messages.images import decode_color, decompress_color
from app.messages.motion import decode_transforms, encode_transforms
from app.robot_file import template
from tests.app.doctor.robot.test_checkup import depth_image
from tests.app.messages.robot_messages import odometry, raw_color
from tests.app.recording.conftest import write_session

STREAMS = (
    keys.COLOR, keys.COLOR_RAW, keys.DEPTH, keys.DEPTH_RAW, keys.CAMERA_INFO, keys.TF,
    keys.TF_STATIC, keys.ODOM,
)  # fmt: skip
LINES = [
    "colour", "depth", "intrinsics", "depth with colour", "pose", "camera and pose clock",
    "profile",
]  # fmt: skip


def _bag(folder, samples):
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for key in STREAMS:
            arrivals = samples.arrivals.get(key)
            if arrivals:
                kind = keys.ROS_TYPES[key]
                to = writer.add_connection(f"/scout/{key}", kind, typestore=typestore())
                for one in arrivals:
                    writer.write(to, one.at_ns, one.payload)
    return folder


def test_a_good_bag_is_well_and_compared_with_its_profile(samples, profile, tmp_path):
    bag = _bag(tmp_path / "bag", samples)
    findings = check_bag(bag, BagRobot(), profile, 3.0)
    assert [(one.what, one.verdict) for one in findings] == [(what, "ok") for what in LINES]
    other = dataclasses.replace(profile, camera_height_m=profile.camera_height_m + 0.3)
    *_, last = check_bag(bag, BagRobot(), other, 3.0)
    assert (last.what, last.verdict) == ("profile", "warning"), "a bag is replayed all the same"
    assert "m above the base, the profile says" in last.detail


def test_depth_in_a_wrong_unit_is_told(samples, change, profile, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")

    def in_millimetres(payload):
        return depth_image(payload, "32FC1", lambda depth: (1000.0 * depth).astype(np.float32))

    change(keys.DEPTH, in_millimetres, keys.DEPTH_RAW)
    bag = _bag(tmp_path / "bag", samples)
    (tmp_path / "scout.yaml").write_text(template(profile))
    words = ["doctor", str(bag), "--profile", str(tmp_path / "scout.yaml")]
    assert run([*words, "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["problems"] == []
    (depth,) = [one for one in told["streams"] if one["what"] == "depth"]
    assert depth["verdict"] == "failed"
    assert "millimetres in an image that must hold metres" in depth["detail"]
    assert run(words) == 1
    out = capsys.readouterr().out
    assert "Streams, at most 10 s from the middle" in out
    assert "publish 32FC1 in metres, or the same numbers as 16UC1" in out


@pytest.mark.parametrize("without", [keys.DEPTH, keys.TF])
def test_without_a_stream_the_file_alone_is_checked(samples, without, tmp_path, capsys):
    if without == keys.TF:
        samples.arrivals[without] = samples.arrivals[without][:1]
        samples.arrivals[without][0].payload = encode_transforms([])
    else:
        del samples.arrivals[without]
    bag = _bag(tmp_path / "bag", samples)
    assert check_bag(bag, BagRobot(), None, 3.0) == []
    assert run(["doctor", str(bag)]) == 1
    out = capsys.readouterr().out
    assert "whole" not in out
    assert "Streams" not in out


def test_odometry_of_a_moment_when_it_was_lost_is_skipped_and_told(samples, tmp_path):
    poses = samples.arrivals.pop(keys.TF)
    mount = encode_transforms(
        one for one in decode_transforms(poses[0].payload) if one.child != "base_link"
    )
    samples.add(keys.TF_STATIC, mount, poses[0].at_ns)
    for n, one in enumerate(poses):
        base = decode_transforms(one.payload)[0]
        x, y = base.T_parent_child[:2, 3]
        samples.add(keys.ODOM, odometry(base.stamp_ns, x, y, 0.0, lost=n == 5), one.at_ns)
    bag = _bag(tmp_path / "bag", samples)
    findings = check_bag(bag, BagRobot(), None, 3.0)
    assert {"colour", "depth", "pose"} <= {one.what for one in findings}
    (lost,) = [one for one in findings if "unreadable" in one.detail]
    assert (lost.what, lost.verdict) == ("odom", "warning")
    assert lost.detail.startswith("odom: 1 skipped as unreadable; the first: tf 'odom' -> ")


def test_a_mount_that_a_bag_lacks_is_not_compared_with_itself(samples, profile, tmp_path):
    for one in samples.arrivals.pop(keys.TF):
        base = decode_transforms(one.payload)[0]
        x, y = base.T_parent_child[:2, 3]
        samples.add(keys.ODOM, odometry(base.stamp_ns, x, y, 0.0), one.at_ns)
    robot = BagRobot(T_base_camera=profile.T_base_camera(0.0))
    *_, last = check_bag(_bag(tmp_path / "bag", samples), robot, profile, 3.0)
    assert (last.what, last.verdict) == ("profile", "ok")
    assert "height, place and tilt are not compared" in last.detail


def test_a_bag_without_a_readable_colour_image_is_told_so(samples, tmp_path, capsys):
    for one in samples.arrivals.pop(keys.COLOR):
        color = decode_color(one.payload)
        pixels = decompress_color(color.encoded)
        samples.add(keys.COLOR_RAW, raw_color(pixels, color.stamp_ns, "yuv422"), one.at_ns)
    bag = _bag(tmp_path / "bag", samples)
    (finding,) = check_bag(bag, BagRobot(), None, 3.0)
    assert (finding.what, finding.verdict) == ("streams", "failed")
    assert "no message of camera/color/image_raw can be read: " in finding.detail
    assert run(["doctor", str(bag)]) == 1
    assert "can be read" in capsys.readouterr().out


def test_a_pause_in_the_middle_and_intrinsics_that_come_once_are_no_fault(samples, tmp_path):
    for key in (keys.COLOR, keys.DEPTH):
        del samples.arrivals[key][6:]
    del samples.arrivals[keys.CAMERA_INFO][1:]
    last = samples.arrivals[keys.TF][-1]
    later = dataclasses.replace(last, at_ns=last.at_ns + 30 * 10**9)
    samples.arrivals[keys.TF].append(later)
    bag = _bag(tmp_path / "bag", samples)
    findings = check_bag(bag, BagRobot(), None, 33.0)
    assert [one for one in findings if one.verdict == "failed"] == []
    assert findings[0].what == "colour"


def test_a_session_of_ours_has_fewer_depth_images_and_no_table(tmp_path, capsys):
    folder = write_session(tmp_path).writer.folder
    assert run(["doctor", str(folder)]) == 0
    out = capsys.readouterr().out
    assert "whole" in out
    assert "Streams" not in out
