"""A simulated robot that turns to and fro, and poses whose clock is another."""

import numpy as np

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


class TurningRobot:
    """Depth images at 5 Hz and poses at 25 Hz of a robot that turns to and fro for five seconds."""

    def __init__(self, yaw_rate=1.0, seed=0):
        self.camera = camera_of(ZED, 160)
        world = SimulatedWorld(
            boxes_scene(BOXES), ZED, self.camera, StartPose(x=0.0, y=0.0, z=0.0, yaw=0.0), seed
        )
        self.depths, self.poses, self.frames = [], [], []
        for k in range(250):
            if k % 2 == 0:
                T = world.T_world_base_estimated @ ZED.T_base_camera(0.0)
                self.poses.append((world.stamp_ns + SECOND, T))
            if k % 10 == 0:
                frame = world.observe()
                self.frames.append(frame)
                self.depths.append((world.stamp_ns + SECOND, frame.depth))
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
