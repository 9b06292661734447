"""What limits a command before the robot gets it."""

import pytest

from ippon.command import Command
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.safe_motion import SafeMotion
from ippon.robot import ZED
from ippon.vocabulary import MATTERPORT_40
from tests.wall_image import wall_image


@pytest.fixture
def motion():
    return SafeMotion(ZED, VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40))


def test_a_robot_starts_slowly_after_its_camera_was_away(motion):
    """Nothing has renewed its last command, so it stands."""
    fast = Command(linear_m_s=0.8)
    motion.resume_from(fast)
    assert motion.accelerate(fast, 0.5, brakes_at_once=False) == fast
    for away_s in (0.6, 2.0, 3600.0):
        motion.resume_from(fast)
        command = motion.accelerate(fast, away_s, brakes_at_once=False)
        assert command.linear_m_s == pytest.approx(0.5 * ZED.max_linear_acceleration_m_s2)


def test_the_older_its_image_the_slower_a_robot_drives_towards_what_it_shows(motion):
    image = wall_image(1.0, T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 0.6)))
    wanted = Command(linear_m_s=0.8)
    safe = [motion.avoid_collision(wanted, image, 0.2, age_s)[0] for age_s in (0.0, 0.3)]
    assert safe[0] == wanted
    assert 0.0 < safe[1].linear_m_s < 0.9 * wanted.linear_m_s
