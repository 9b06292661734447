"""Compiles every kernel before the first frame, by searching a small home for a moment."""

import math
from collections.abc import Callable
from typing import Final

from app.nodes.navigator.config import NavigatorConfig
from ippon.camera import PinholeCamera
from ippon.evaluation.episode import EpisodeLimits, run_episode
from ippon.guidance.levels import Guidance, LabelLevel, Level
from ippon.mapping.surface import SurfaceTracker
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld

STEPS: Final = 45
"""Long enough to look around, drive, and connect viewpoints by local paths."""
HOME_SEED: Final = 4


def warm_up(config: NavigatorConfig, progress: Callable[[float], None]) -> None:
    """Run a real search for a few seconds of simulated time.

    Args:
        config: Kernels are compiled for its map.
        progress: Called with the fraction that is done.
    """
    scene = generate_home(HOME_SEED)
    camera = PinholeCamera.from_horizontal_fov(96, 60, math.radians(74.0))
    world = SimulatedWorld(scene, config.profile, camera, scene.start_poses[0])
    mission = Mission(config.mission, config.profile, config.labels, seed=0)
    rows = tuple(LabelLevel(label=label, level=Level.AVERAGE, reason="") for label in config.labels)
    guidance = Guidance(ooi="hat", context="", provider="", rows=rows)
    mission.set_goal(Goal(goal_id=0, object="hat", display="hat"), guidance)
    tracker = SurfaceTracker(mission.voxel_map)
    for k, _ in enumerate(run_episode(world, mission, EpisodeLimits(max_time_s=0.2 * STEPS))):
        tracker.update()
        progress((k + 1) / STEPS)
    mission.reject_find()
    tracker.keyframe()
