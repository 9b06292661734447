import dataclasses

import numpy as np
import pytest

from app.doctor.robot.clock_offset import check_offset, estimate_offset
from app.links.robot_streams.transforms import TransformBuffer
from app.messages.motion import StampedTransform
from ippon.command import Command
from ippon.robot import ZED
from ippon.simulation.robot.mobile_base import camera_of
from ippon.simulation.scene import StartPose
from ippon.simulation.world import SimulatedWorld
from tests.app.doctor.robot.conftest import BOXES
from tests.boxes import boxes_scene

SECOND = 1_000_000_000


class Recorded:
    """Depth images at 5 Hz and poses at 25 Hz of a robot that turns to and fro for five seconds."""

    def __init__(self, yaw_rate=1.0, seed=0):
        self.camera = camera_of(ZED, 160)
        world = SimulatedWorld(
            boxes_scene(BOXES), ZED, self.camera, StartPose(x=0.0, y=0.0, z=0.0, yaw=0.0), seed
        )
        self.depths, self.poses = [], []
        for k in range(250):
            if k % 2 == 0:
                T = world.T_world_base_estimated @ ZED.T_base_camera(0.0)
                self.poses.append((world.stamp_ns + SECOND, T))
            if k % 10 == 0:
                self.depths.append((world.stamp_ns + SECOND, world.observe().depth))
            sign = 1.0 if (k // 75) % 2 == 0 else -1.0
            world.step(Command(linear_m_s=0.2, yaw_rate_rad_s=sign * yaw_rate), 0.02)

    def pose_at(self, offset_s=0.0, jitter_s=0.0):
        """Return poses whose clock is ahead of the camera's."""
        buffer, rng = TransformBuffer(history=1000), np.random.default_rng(0)
        for stamp, T in self.poses:
            moved = stamp + round(1e9 * (offset_s + jitter_s * rng.standard_normal()))
            buffer.add(
                StampedTransform(stamp_ns=moved, parent="map", child="eye", T_parent_child=T)
            )
        return lambda stamp: buffer.lookup("map", "eye", stamp)


@pytest.fixture(scope="module")
def turning():
    return Recorded()


@pytest.mark.slow
@pytest.mark.parametrize("offset_s", [-0.18, -0.05, 0.0, 0.08, 0.2])
def test_the_offset_is_found_within_ten_milliseconds(turning, offset_s):
    estimate = estimate_offset(turning.depths, turning.camera, turning.pose_at(offset_s))
    assert estimate.offset_s == pytest.approx(offset_s, abs=0.01)
    assert estimate.error_s < 0.01


@pytest.mark.slow
def test_jitter_of_the_poses_does_not_shift_it(turning):
    pose_at = turning.pose_at(0.1, jitter_s=0.01)
    assert estimate_offset(turning.depths, turning.camera, pose_at).offset_s == pytest.approx(
        0.1, abs=0.015
    )


@pytest.mark.slow
def test_the_line_offers_the_entry_of_the_profile(turning):
    finding = check_offset(turning.depths, turning.camera, turning.pose_at(0.12))
    assert finding.verdict == "warning"
    assert "`clock_offset_ms: 12" in finding.do or "`clock_offset_ms: 11" in finding.do
    assert "degrees" in finding.detail
    corrected = turning.pose_at(0.12)
    known = check_offset(turning.depths, turning.camera, lambda s: corrected(s + 120_000_000), 0.12)
    assert known.verdict == "ok", known


@pytest.mark.slow
def test_a_robot_that_stands_tells_nothing():
    standing = dataclasses.replace(
        check_offset((still := Recorded(yaw_rate=0.0)).depths, still.camera, still.pose_at()), do=""
    )
    assert standing.verdict == "ok"
    assert "not compared" in standing.detail
