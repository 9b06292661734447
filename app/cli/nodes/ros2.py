"""`ippon ros2`: the bridge to ROS 2, run here or written for the robot."""

import shutil
import tomllib
from pathlib import Path
from typing import Final

from app import ros2
from app.cli.options.ros2 import Ros2
from app.errors import UsageError

PROJECT: Final = "pyproject.toml"


def run_ros2(command: Ros2) -> int:
    """Write the bridge's package, or run it."""
    if command.write is not None:
        print(f"{write_package(command.write)}: copy it to the robot")
        return 0
    from app.ros2.ippon_ros2.__main__ import main

    arguments = ["--connect", command.connect, "--robot", command.robot]
    if command.profile is not None:
        arguments += ["--profile", str(command.profile)]
    return main([*arguments, "--check"] if command.check else arguments)


def write_package(folder: Path) -> Path:
    """Copy the bridge's package, with what pip installs it by; return its folder.

    Raises:
        UsageError: It cannot be written, or the folder is that of another package.
    """
    source = Path(ros2.__file__).parent
    target = folder / "ippon_ros2"
    try:
        if not _is_free(folder / PROJECT):
            raise UsageError(f"{folder / PROJECT} is of another package; name another folder")
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(source / PROJECT, folder)
        shutil.copytree(
            source / "ippon_ros2", target, dirs_exist_ok=True,
            ignore=shutil.ignore_patterns("__pycache__"),
        )  # fmt: skip
    except OSError as error:
        raise UsageError(f"cannot write the package to {folder}: {error}") from error
    return target


def _is_free(project: Path) -> bool:
    """Return whether there is no such file, or that of an earlier copy."""
    if not project.exists():
        return True
    try:
        return tomllib.loads(project.read_text("utf-8"))["project"]["name"] == "ippon-ros2"
    except (ValueError, KeyError, TypeError):
        return False
