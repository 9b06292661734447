"""`ippon sim`: a simulated robot on zenoh, or a picture of its home."""

import logging
from pathlib import Path

from app.cli.options.nodes import Sim
from app.cli.tools.save_picture import save_picture
from app.errors import UsageError
from app.homes import load_home

logger = logging.getLogger(__name__)

PIXELS_PER_METRE = 80.0


def run_sim(command: Sim) -> int:
    """Draw or export the home, or drive a robot in it until it is stopped."""
    if command.picture is not None and command.export is not None:
        raise UsageError("a home is drawn or exported: give --picture or --export, not both")
    if command.picture is not None:
        draw_home(command.home, command.picture)
        return 0
    if command.export is not None:
        export_home(command.home, command.export)
        return 0
    from app.links.network.session import LinkError
    from app.nodes.robot_sim import RobotSimConfig, SimulatedRobotError, run_robot_sim
    from app.process.parent_watch import end_with_parent
    from app.robot_file import read_profile

    end_with_parent(command.parent_pid)
    scene = load_home(command.home)
    if not 0 <= command.start < len(scene.start_poses):
        raise UsageError(
            f"home {command.home} has start poses 0 to {len(scene.start_poses) - 1}; "
            f"got {command.start}"
        )
    try:
        config = RobotSimConfig(
            connect=command.connect,
            robot=command.robot,
            profile=read_profile(command.profile),
            speed=command.speed,
            seed=command.seed,
            rate_hz=command.rate_hz,
            image_width=command.width,
        )
    except ValueError as error:
        raise UsageError(str(error)) from error
    try:
        run_robot_sim(config, scene, scene.start_poses[command.start])
    except (LinkError, SimulatedRobotError) as error:
        raise UsageError(str(error)) from error
    except KeyboardInterrupt:
        logger.info("stopped before its first frame")
    return 0


def draw_home(home: str, picture: Path) -> None:
    """Write a picture of the home from above.

    Raises:
        UsageError: The file cannot be written.
    """
    if not picture.parent.is_dir():
        raise UsageError(f"cannot write the picture: the folder {picture.parent} does not exist")
    scene = load_home(home)
    from PIL import Image

    from ippon.simulation.camera.home_picture import picture_from_above

    image = picture_from_above(scene, pixels_per_metre=PIXELS_PER_METRE)
    save_picture(Image.fromarray(image), picture)
    print(f"{picture}: {image.shape[1]} x {image.shape[0]} pixels")


def export_home(home: str, folder: Path) -> None:
    """Write the home as a folder that `--home` takes.

    Raises:
        UsageError: The folder cannot be written.
    """
    scene = load_home(home)
    from ippon.simulation.scene_writer import save_scene

    try:
        save_scene(scene, folder)
    except OSError as error:
        raise UsageError(f"cannot write the home to {folder}: {error}") from error
    print(f"{folder}: scene.glb and scene.json with {len(scene.instances)} objects")
