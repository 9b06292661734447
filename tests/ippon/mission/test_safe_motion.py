"""What limits a command before the robot gets it."""

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.safe_motion import SafeMotion
from ippon.robot import ZED
from ippon.vocabulary import MATTERPORT_40

WALL_M = 1.0


@pytest.fixture
def before_a_wall():
    """A robot whose image shows a wall ahead."""
    return Frame(
        stamp_ns=1,
        color=np.zeros((90, 120, 3), np.uint8),
        depth=np.full((90, 120), WALL_M, np.float32),
        camera=PinholeCamera.from_horizontal_fov(120, 90, 1.2),
        T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 0.6)),
        T_world_base=np.eye(4),
        tilt_rad=0.0,
        heatmap=None,
        contact=False,
    )


def test_the_older_its_image_the_slower_a_robot_drives_towards_what_it_shows(before_a_wall):
    motion = SafeMotion(ZED, VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40))
    wanted = Command(linear_m_s=0.8)
    safe = [motion.avoid_collision(wanted, before_a_wall, 0.2, age_s)[0] for age_s in (0.0, 0.3)]
    assert safe[0] == wanted
    assert 0.0 < safe[1].linear_m_s < 0.9 * wanted.linear_m_s
