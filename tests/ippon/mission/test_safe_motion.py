"""What limits a command before the robot gets it."""

from ippon.command import Command
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.safe_motion import SafeMotion
from ippon.robot import ZED
from ippon.vocabulary import MATTERPORT_40
from tests.wall_image import wall_image


def test_the_older_its_image_the_slower_a_robot_drives_towards_what_it_shows():
    motion = SafeMotion(ZED, VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40))
    image = wall_image(1.0, T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 0.6)))
    wanted = Command(linear_m_s=0.8)
    safe = [motion.avoid_collision(wanted, image, 0.2, age_s)[0] for age_s in (0.0, 0.3)]
    assert safe[0] == wanted
    assert 0.0 < safe[1].linear_m_s < 0.9 * wanted.linear_m_s
