"""Options of `ippon ros2`."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Ros2:
    """Bridge between a ROS 2 robot and the navigator; runs on the robot, in its own Python.

    It needs only rclpy and eclipse-zenoh. Copy it to the robot:

    `ippon ros2 --write FOLDER` writes the package `ippon_ros2`. On the robot, `python3 -m
    ippon_ros2 --check` shows which topics are there, and `python3 -m ippon_ros2 --connect
    tcp/NAVIGATOR:7447 --profile scout.yaml` carries them. Where this Python has ROS 2, the same
    options work here.
    """

    write: Path | None = None
    """Write the package into this folder, and end."""
    connect: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint of the navigator."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    profile: Path | None = None
    """The robot's YAML profile; its `ros2` section names topics. Without one, the usual names."""
    check: bool = False
    """Show which of the topics are there, with types and rates, and end."""
