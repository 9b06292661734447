"""`ippon replay`: a dataset or a bag, published as a robot."""

from app.cli.options.nodes import Replay
from app.datasets.bag_robot import read_bag_robot
from app.datasets.dataset import DatasetError
from app.errors import UsageError
from app.links.network.registry import resolve_address
from app.links.network.session import LinkError
from app.nodes.replay import ReplayConfig, run_replay
from app.process.parent_watch import end_with_parent


def run_replay_command(command: Replay) -> int:
    """Play until the end, or until the process is stopped."""
    end_with_parent(command.parent_pid)
    connect, robot = resolve_address(command.connect, command.robot)
    try:
        bag_robot = read_bag_robot(command.profile, command.base_frame)
        config = ReplayConfig(
            path=command.path,
            connect=connect,
            robot=robot,
            rate=command.rate,
            start_s=command.start_s,
            loop=command.loop,
            heatmaps=command.heatmaps,
            poses=command.poses,
            floor_m=command.floor_m,
            names=bag_robot.names,
            T_base_camera=bag_robot.T_base_camera,
            clock_offset_s=bag_robot.clock_offset_s,
            base=bag_robot.base,
        )
    except ValueError as error:
        raise UsageError(str(error)) from error
    try:
        run_replay(config)
    except (DatasetError, LinkError) as error:
        raise UsageError(str(error)) from error
    return 0
