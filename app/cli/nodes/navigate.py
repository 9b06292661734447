"""`ippon navigate`: the navigator."""

import logging
import math
import os
import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import Final

import platformdirs
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from app.cli.config_file import beyond_flags, read_config
from app.cli.nodes.segment import arguments_of
from app.cli.options.nodes import Navigate
from app.cli.tools.language_model import make_model
from app.configuration import changed
from app.errors import UsageError
from app.links.language_model.interface import LanguageModelInterface
from app.links.loopback import reachable
from app.links.network.session import LinkError
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.localization.alignment import NoFrameError
from app.nodes.navigator.run import run_navigator
from app.nodes.navigator.state.persistence import SavedState, read_saved_state
from app.process.children import Child
from app.process.parent_watch import end_with_parent
from app.robot_file import Robot, map_config, read_robot
from ippon.errors import MapFileError
from ippon.mission.config import MissionConfig
from ippon.observation_model import (
    ObservationModel,
    ObservationModelError,
    read_observation_model,
)
from ippon.planning.config import PlannerConfig
from ippon.segmentation.detectors.detector import source_name
from ippon.vocabulary import MATTERPORT_40

logger = logging.getLogger(__name__)

SLOW_SEGMENTATION_S: Final = 30.0
"""Limit with a segmentation on this machine: without a GPU, an image may take ten seconds."""


def run_navigate(command: Navigate) -> int:
    """Navigate until the process is stopped."""
    end_with_parent(command.parent_pid)
    model = make_model(command.llm, os.environ)
    if not 0.0 <= command.step_budget_s < math.inf:
        raise UsageError(
            "--step-budget-s is the planning time per frame, 0 for a limit on evaluations instead; "
            f"got {command.step_budget_s:g}"
        )
    config, saved, robot = _config_of(command, model)
    ros2 = robot.rmw_zenoh if command.connect_robot else None
    if saved is not None:
        area = 0.0 if saved.voxel_map is None else saved.voxel_map.explored_m2()
        logger.info("restored a map of %.0f m2 and %d goals", area, len(saved.requests))
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
        console=Console(file=sys.stderr),
        transient=True,
    )
    segmentation = _start_segmentation(command)
    try:
        with progress:
            task = progress.add_task("preparing kernels (compiled once)", total=1.0)

            def show(fraction: float) -> None:
                progress.update(task, completed=fraction)
                if fraction >= 1.0:
                    progress.stop()

            run_navigator(config, show, model, saved, align=command.align, ros2=ros2)
    except (LinkError, NoFrameError) as error:
        raise UsageError(str(error)) from error
    except KeyboardInterrupt:
        logger.info("stopped before it was ready")
    finally:
        if segmentation is not None:
            segmentation.stop()
    return 0


def _config_of(
    command: Navigate, model: LanguageModelInterface | None
) -> tuple[NavigatorConfig, SavedState | None, Robot]:
    """Return the configuration from flags and file, the saved state of `--map`, and the profile.

    Raises:
        UsageError: A flag, the file or the saved state cannot be used.
    """
    if command.align and command.map is None:
        raise UsageError("--align finds the robot's place in a kept map: name it with --map FILE")
    if command.resume and (command.map is None or command.align):
        raise UsageError(
            "--resume goes on with the goals of --map FILE, in the same frame: it needs --map, and "
            "does not go with --align"
        )
    changes = beyond_flags(Navigate, read_config(command.config))
    try:
        robot = read_robot(command.profile)
        profile = robot.profile
        if command.align and (profile.tracks_pose or not profile.takes_velocities):
            raise UsageError(
                "--align turns the robot by velocities where it stands, and profile "
                f"{profile.name} takes none: begin another map with --map FILE"
            )
        mission = MissionConfig(
            map=map_config(profile, command.voxel_size_m, command.map_memory_mb),
            planner=PlannerConfig(step_budget_s=command.step_budget_s or None),
        )
        mission = changed(mission, changes.pop("mission", {}), ("mission",))
        saved = None if command.map is None else read_saved_state(command.map, mission.map)
        voxel_map = None if saved is None else saved.voxel_map
        config = NavigatorConfig(
            listen=command.listen,
            robot=command.robot,
            profile=profile,
            detector=robot.detector,
            camera_clock_offset_s=robot.clock_offset_s,
            observation_model=_observation_model(command),
            seed=command.seed,
            mission=mission,
            language_model=model.name if model is not None else "",
            look_every_s=command.llm.look_every_s,
            second_opinion=command.llm.second_opinion,
            labels=MATTERPORT_40 if voxel_map is None else voxel_map.labels,
            resume=command.resume,
            keep_map="" if command.map is None else str(command.map),
            keep_searches=str(saved_searches_path(command.robot)),
        )
        if voxel_map is not None:
            changes.pop("labels", None)  # The labels of a map cannot be replaced.
        config = changed(config, changes)
    except (ValueError, MapFileError, OSError) as error:
        raise UsageError(str(error)) from error
    if command.segmentation.where == "here" and "heatmap_lost_s" not in changes:
        config = replace(config, heatmap_lost_s=SLOW_SEGMENTATION_S)
    return config, saved, robot


def saved_searches_path(robot: str) -> Path:
    """Return the file of a robot's saved searches, which do not depend on a map."""
    folder = platformdirs.user_data_path("ippon") / "searches"
    return folder / f"{robot.replace('/', '_')}.json"


def _observation_model(command: Navigate) -> ObservationModel | None:
    """Read an observation model; raises UsageError, also for one of another detector."""
    path, network = command.observation_model, command.segmentation
    if path is None:
        return None
    try:
        model = read_observation_model(path)
        if network.where == "here" and network.backend != "installed":
            # The other backends have their own name as source.
            is_file = network.backend == "detector"
            source = source_name(Path(network.model)) if is_file else network.backend
            model.check_network(source, "distribution" if network.backend == "san" else "scores")
    except ObservationModelError as error:
        raise UsageError(str(error)) from error
    if model.note:
        logger.warning("%s", model.note)
    return model


def _start_segmentation(command: Navigate) -> Child | None:
    """Start the segmentation process if it runs on this machine."""
    if command.segmentation.where != "here":
        return None
    arguments = ["segment", "--connect", reachable(command.listen), "--robot", command.robot]
    child = Child("segmentation", [*arguments, *arguments_of(command.segmentation)])
    threading.Thread(target=_report_end, args=(child,), name="segmentation", daemon=True).start()
    return child


def _report_end(child: Child) -> None:
    """Log that the segmentation ended by itself; the search continues without heatmaps."""
    status = child.wait()
    if child.stopped:
        return
    how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
    logger.error(
        "the segmentation %s: objects are no longer recognised; `ippon segment` starts another",
        how,
    )
