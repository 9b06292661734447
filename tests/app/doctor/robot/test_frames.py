"""Poses of a robot that sends them fast."""

from app.doctor.robot.frames import check_frames
from app.doctor.robot.samples import SECONDS, Samples
from app.messages import keys
from app.messages.motion import encode_transforms, robot_transforms
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
