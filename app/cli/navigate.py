"""`ippon navigate`: the navigator."""

import os
import sys

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from app.cli.errors import UsageError
from app.cli.language_model import make_model
from app.cli.options import Navigate
from app.links.parent import end_with_parent
from app.links.session import LinkError
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.node import run_navigator
from ippon.mapping.voxel_map import MapConfig
from ippon.mission.mission import MissionConfig


def run_navigate(command: Navigate) -> int:
    """Navigate until the process is stopped."""
    end_with_parent(command.parent_pid)
    model = make_model(command.llm, os.environ)
    try:
        mission = MissionConfig(map=MapConfig(voxel_size_m=command.voxel_size_m))
        config = NavigatorConfig(
            listen=command.listen,
            robot=command.robot,
            seed=command.seed,
            mission=mission,
            language_model=model.name if model is not None else "",
        )
    except ValueError as error:
        raise UsageError(str(error)) from error
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
        console=Console(file=sys.stderr),
        transient=True,
    )
            look_every_s=command.llm.look_every_s,
    try:
        with progress:
            task = progress.add_task("preparing kernels (compiled once)", total=1.0)

            def show(fraction: float) -> None:
                progress.update(task, completed=fraction)
                if fraction >= 1.0:
                    progress.stop()

            run_navigator(config, show, model)
    except LinkError as error:
        raise UsageError(str(error)) from error
    return 0
