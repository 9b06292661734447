"""Poses of a robot that sends them fast, or that has very many frames."""

import numpy as np

from app.doctor.robot.frames import check_frames
from app.doctor.robot.samples import SECONDS, Samples
from app.links.robot_streams.transforms import MAX_FRAMES
from app.messages import keys
from app.messages.motion import StampedTransform, encode_transforms, robot_transforms
from ippon.geometry import base_pose
from ippon.robot import ZED

HZ = 500


def test_all_images_have_a_pose_where_tf_comes_500_times_a_second():
    samples, stamps_ns = Samples(seconds=SECONDS), []
    for k in range(round(SECONDS * HZ)):
        stamp_ns = 10**9 + k * 10**9 // HZ
        T_world_base = base_pose(0.001 * k, 0.0, 0.0, 0.0)
        transforms = robot_transforms(stamp_ns, T_world_base, ZED.T_base_camera(0.0), "camera")
        samples.add(keys.TF, encode_transforms(transforms), stamp_ns)
        if k % 100 == 0:
            stamps_ns.append(stamp_ns)
    (finding,) = check_frames(samples, "camera", stamps_ns)
    assert finding.verdict == "ok", finding
    assert "a pose for 100% of the images" in finding.detail


def test_more_frames_than_a_navigator_takes_are_said():
    samples = Samples(seconds=SECONDS)
    transforms = [
        *robot_transforms(10**9, base_pose(0.0, 0.0, 0.0, 0.0), ZED.T_base_camera(0.0), "camera"),
        *(
            StampedTransform(
                stamp_ns=10**9, parent="base_link", child=f"part{k}", T_parent_child=np.eye(4)
            )
            for k in range(MAX_FRAMES)
        ),
    ]
    samples.add(keys.TF, encode_transforms(transforms), 10**9)
    (finding,) = check_frames(samples, "camera", [10**9])
    assert (finding.what, finding.verdict) == ("tf", "failed")
    assert f"more than {MAX_FRAMES} coordinate frames" in finding.detail
