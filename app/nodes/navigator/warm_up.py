"""Compiles every kernel before the first frame, by a short search in a small home.

The first compilation takes most of a minute of one core. The kernels of the map and those of the
simulated home take half of it each, so another process compiles the latter at the same time; with a
third core, a further process compiles a part of the map's.
"""

import contextlib
import logging
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

from app.nodes.navigator.config import NavigatorConfig
from app.process.kernel_cache import COMPLETE
from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.compiling import compile_in_second_process
from ippon.control.drops import drops_around
from ippon.evaluation.episode import EpisodeLimits, run_episode
from ippon.frame import Frame
from ippon.guidance.levels import Guidance, LabelLevel, Level
from ippon.mapping.objects.surface_changes import SurfaceTracker
from ippon.mapping.warm_up import warm_up as warm_up_map
from ippon.mapping.warm_up import warm_up_far_evidence
from ippon.mission.explanation import NEARBY_M, label_census
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.planning.warm_up import warm_up as warm_up_planning
from ippon.robot import RobotProfile
from ippon.segmentation.warm_up import warm_up_instances
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld

logger = logging.getLogger(__name__)

STEPS: Final = 20
"""Long enough to look around, drive, and connect viewpoints by local paths."""
STEPS_OF_A_LONG_BODY: Final = 45
"""Long enough to come to a door that it can pass only straight."""
HOME_SEED: Final = 4
MAP_STEPS: Final = 4


def warm_up(config: NavigatorConfig, progress: Callable[[float], None]) -> None:
    """Run a search for a few seconds of simulated time, then the kernels that it did not use.

    Args:
        config: Kernels are compiled for its map.
        progress: Called with the fraction that is done.
    """
    complete = _complete()
    first = complete is not None and not complete.exists()
    if first:
        # Where nobody sees the bar, in a service or a pipe, it is a minute of silence otherwise.
        logger.info("compiling the kernels: a minute or more, at the first start only")
    before = _compile_map(progress, first=first)
    # A step that exceeds its budget during compilation would skip other kernels.
    mission = Mission(config.mission.counted(), config.profile, config.labels, seed=0)
    rows = tuple(LabelLevel(label=label, level=Level.AVERAGE, reason="") for label in config.labels)
    guidance = Guidance(ooi="hat", context="", provider="", rows=rows)
    mission.goals.set_goal(Goal(goal_id=0, object="hat", display="hat"), guidance)
    tracker = SurfaceTracker(mission.voxel_map)
    world = _small_home(config.profile)
    steps = STEPS if config.profile.is_round else STEPS_OF_A_LONG_BODY
    for k, _ in enumerate(run_episode(world, mission, EpisodeLimits(max_time_s=0.2 * steps))):
        tracker.update()
        progress(before + (1.0 - before) * (k + 1) / steps)
    tracker.keyframe()
    _use_the_rest(mission, world.observe(), guidance)
    if complete is not None:
        with contextlib.suppress(OSError):
            # Without the marker, the next start compiles again.
            complete.touch()


def _use_the_rest(mission: Mission, frame: Frame, guidance: Guidance) -> None:
    """Run operations that a search may need for the first time long after its start."""
    mission.learn(frame)
    mission.preview(guidance)
    mission.goals.set_guidance(guidance)
    mission.operator.go_to((float(frame.T_world_base[0, 3]), float(frame.T_world_base[1, 3])))
    mission.step(frame)
    label_census(mission.voxel_map, frame.T_world_base[:3, 3], NEARBY_M)
    warm_up_far_evidence()
    warm_up_instances()
    arrays, robot, at = mission.voxel_map.arrays(), mission.robot, frame.T_world_base
    warm_up_planning(arrays, robot, at)
    drops_around(arrays, robot, at, robot.radius_m, hidden=True)
    goals = [Goal(goal_id=n, object=name, display=name) for n, name in enumerate(("hat", "mug"))]
    mission.goals.set_goals([(goal, guidance) for goal in goals])
    mission.step(frame)


def warm_up_simulation() -> None:
    """Compile the kernels of a simulated home; runs in another process."""
    config = NavigatorConfig()
    world = _small_home(config.profile)
    world.set_labels(config.labels, "hat")
    world.observe()
    world.step(Command(linear_m_s=0.3), 0.2)


def _small_home(profile: RobotProfile) -> SimulatedWorld:
    scene = generate_home(HOME_SEED)
    camera = PinholeCamera.from_horizontal_fov(96, 60, math.radians(74.0))
    return SimulatedWorld(scene, profile, camera, scene.start_poses[0])


def _complete() -> Path | None:
    folder = os.environ.get("NUMBA_CACHE_DIR")
    return Path(folder) / COMPLETE if folder else None


def _compile_map(progress: Callable[[float], None], *, first: bool) -> float:
    """Compile the map's kernels, and at the first start those of a simulated home in parallel.

    Returns:
        The fraction done.
    """
    share = 0.6 if first else 0.1
    # With a third core, two processes compile the map's kernels.
    spare = first and (os.cpu_count() or 1) > 2
    beside = (
        compile_in_second_process(__name__, "warm_up_simulation")
        if first
        else contextlib.nullcontext()
    )
    with beside:
        for k, _ in enumerate(warm_up_map(beside=spare)):
            progress(share * k / MAP_STEPS)
    return share
