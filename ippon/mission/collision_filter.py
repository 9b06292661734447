"""The last word on a mission's command: nothing that was seen is driven into."""

from ippon.command import Command
from ippon.control.safety_filter import filter_command
from ippon.frame import Frame
from ippon.mapping.voxel_map import VoxelMap
from ippon.robot import RobotProfile

MIN_HORIZON_S, MAX_HORIZON_S = 0.1, 0.5
"""A command holds until the next frame; the last interval tells how long that is, within these."""


def moves_base(command: Command) -> bool:
    """Tell whether a command drives or turns the body."""
    return not command.linear_m_s == command.yaw_rate_rad_s == 0.0


def without_collision(
    command: Command, frame: Frame, robot: RobotProfile, voxel_map: VoxelMap, dt_s: float
) -> tuple[Command, str | None]:
    """Keep a command from driving the body into what map and newest image show.

    Args:
        command: What is wanted.
        frame: Where the robot stands, and what it sees.
        robot: Its body.
        voxel_map: What is known of its surroundings.
        dt_s: Seconds since the frame before.

    Returns:
        The command as it may be carried out, and why it is less than wanted, None where it is not.
    """
    if not moves_base(command):
        return command, None
    horizon_s = min(max(dt_s, MIN_HORIZON_S), MAX_HORIZON_S)
    return filter_command(command, frame.T_world_base, robot, voxel_map.arrays(), horizon_s, frame)
