"""How directly methods bring things into view, without a single object's luck.

A search that has no hope: the robot explores a home for something that is not there, with every
level average, and for each kind of object that is there the way is noted which it had driven when
one of its kind first filled 0.05 % of an image within range. One run so counts for a dozen
searches. Efficiency is the shortest way over what was driven by then plus what was left from there,
as in SPL; homes weigh alike. What the object itself tells (levels, images from afar, a find) has no
part in it.
"""

import dataclasses
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.evaluation.episode import run_episode
from ippon.evaluation.episode_generation import EpisodeGenerationConfig, list_episodes
from ippon.evaluation.goal_objects import matching_instances
from ippon.evaluation.methods.method_table import METHODS, Method, PlannerInputs
from ippon.evaluation.metrics import Judge
from ippon.evaluation.outcome import shows_object
from ippon.evaluation.trial import TrialConfig, habitat_trial
from ippon.guidance.language.naming import is_instance_of, resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.config import MissionConfig
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.scene import Scene, StartPose
from ippon.simulation.world import SimulatedWorld
from tests.benchmarks.rows import Row

FIRST_HOME = 2300
LONGEST_S = 300.0
LEAST_WAYS_M = (1.0, 4.0, 8.0)
IN_VAIN = "umbrella"
EVERYWHERE_M = 1e3
METHODS_COMPARED = ("ippon", "paper", "nearest_frontier", "greedy_nbv")


def _near_rays(config: MissionConfig) -> MissionConfig:
    view = dataclasses.replace(config.planner.view, unknown_depth_m=1.5)
    return dataclasses.replace(config, planner=dataclasses.replace(config.planner, view=view))


def _selecting(**change: float) -> Callable[[MissionConfig], MissionConfig]:
    def configure(config: MissionConfig) -> MissionConfig:
        selection = dataclasses.replace(config.planner.selection, **change)
        planner = dataclasses.replace(config.planner, selection=selection)
        return dataclasses.replace(config, planner=planner)

    return configure


VARIANTS: dict[str, Callable[[MissionConfig], MissionConfig]] = {
    "rays through 1.5 m of unknown space": _near_rays,
    "gain over cost, no commitment": _selecting(cost_power=1.0, stay_power=0.0),
    "commitment that does not fade": _selecting(fade_power=0.0),
}
"""Parts of `ippon` that are left out, one at a time."""
COMPARED: dict[str, Method] = {name: METHODS[name] for name in METHODS_COMPARED} | {
    f"ippon with {name}": dataclasses.replace(METHODS["ippon"], configure=configure)
    for name, configure in VARIANTS.items()
}


@dataclass(frozen=True, kw_only=True)
class Seen:
    """A kind of object, and what it took until one of it was in view."""

    shortest_m: float
    driven_m: float
    left_m: float
    time_s: float

    @property
    def efficiency(self) -> float:
        """Shortest way over what was driven and left, at most 1."""
        return min(1.0, self.shortest_m / max(self.driven_m + self.left_m, 1e-9))


def exploring_rows(homes: int) -> Iterator[Row]:
    """Explore so many homes by each method."""
    config = habitat_trial()
    limits = dataclasses.replace(config.limits, max_time_s=LONGEST_S)
    config = dataclasses.replace(config, limits=limits)
    runs: dict[str, list[list[Seen]]] = {name: [] for name in COMPARED}
    for seed in range(FIRST_HOME, FIRST_HOME + homes):
        scene = generate_home(seed)
        for name, method in COMPARED.items():
            runs[name].append(explore(config, scene, method, seed))
    for least_m in LEAST_WAYS_M:
        first: NDArray[np.float64] | None = None
        for name in COMPARED:
            each = [[s for s in run if s.shortest_m >= least_m] for run in runs[name]]
            each = [run for run in each if run]
            if not each:
                continue
            data = f"{sum(map(len, each))} kinds in {len(each)} homes, {least_m:g} m away and more"
            mean = np.array([np.mean([s.efficiency for s in run]) for run in each])
            seconds = float(np.mean([np.mean([s.time_s for s in run]) for run in each]))
            first = mean if first is None else first
            yield Row(
                name=f"efficiency of exploring, {name}",
                data=data,
                value=float(mean.mean()),
                note=f"in {seconds:.0f} s; {_difference(first - mean)}",
            )


def explore(config: TrialConfig, scene: Scene, method: Method, seed: int) -> list[Seen]:
    """Explore a home from one of its starts until every kind was in view, or time is up.

    Args:
        config: Robot, camera, world, mission and the longest time.
        scene: The home.
        method: Says where to go.
        seed: Of the start, the world's noise and the planner.

    Returns:
        One entry for each kind that a way leads to; those that never came into view count as seen
        at the end.
    """
    listed, _ = list_episodes(scene, str(seed), config.robot, EpisodeGenerationConfig(seed=5))
    start = listed[np.random.default_rng(seed).integers(len(listed))].start
    at_start = (start.x, start.y, 0.0)
    goals = [g for g in EpisodeGenerationConfig().goals if matching_instances(scene, g)]
    judges = {goal: Judge(scene, config.robot, goal) for goal in goals}
    shortest = {goal: judge.distance_m(at_start) for goal, judge in judges.items()}
    judges = {g: j for g, j in judges.items() if 1.0 <= shortest[g] < math.inf}
    world, mission = _in_vain(config, scene, method, seed, next(iter(judges.values())), start)
    reach_m = min(config.mission.map.ooi_max_range_m, config.robot.max_depth_m)
    seen: dict[str, Seen] = {}
    driven_m, last = 0.0, at_start
    for _ in run_episode(world, mission, config.limits):
        here = (world.base.x_m, world.base.y_m, 0.0)
        driven_m, last = driven_m + math.dist(here, last), here
        rendering = world.rendering
        assert rendering is not None, "a frame was taken"
        for goal, judge in judges.items():
            if goal not in seen and shows_object(rendering, judge.instances, reach_m):
                seen[goal] = _seen(judge, shortest[goal], driven_m, here, world)
        if len(seen) == len(judges):
            break
    for goal, judge in judges.items():
        if goal not in seen:
            seen[goal] = _seen(judge, shortest[goal], driven_m, last, world)
    return list(seen.values())


def _seen(
    judge: Judge,
    shortest_m: float,
    driven_m: float,
    here: tuple[float, float, float],
    world: SimulatedWorld,
) -> Seen:
    return Seen(
        shortest_m=shortest_m,
        driven_m=driven_m,
        left_m=judge.distance_m(here),
        time_s=world.stamp_ns * 1e-9,
    )


def _in_vain(
    config: TrialConfig, scene: Scene, method: Method, seed: int, judge: Judge, start: StartPose
) -> tuple[SimulatedWorld, Mission]:
    """Put a robot at the start that looks for what it will never find."""
    far_evidence = dataclasses.replace(config.mission.far_evidence, enabled=False)
    mission_config = method.configure(
        dataclasses.replace(config.mission, far_evidence=far_evidence)
    )
    resolved = resolve_object(IN_VAIN, config.labels)
    guidance = EmbeddedPrior().levels(resolved, "", config.labels)
    guidance = METHODS["no_guidance"].guide(guidance)
    planner_setup = method.make_planner(
        PlannerInputs(
            config=mission_config,
            robot=config.robot,
            guidance=guidance,
            seed=seed,
            scene=scene,
            judge=judge,
            goal=IN_VAIN,
            parameters=method.parameters,
        )
    )
    planner = planner_setup.planner
    mission = Mission(mission_config, config.robot, config.labels, seed, planner=planner)
    goal = Goal(goal_id=1, object=IN_VAIN, display=IN_VAIN, context="", category=resolved.category)
    mission.goals.set_goal(goal, guidance)
    # Nothing anywhere is taken for it.
    mission.voxel_map.suppress_ooi(np.zeros(3), EVERYWHERE_M)
    world = SimulatedWorld(
        scene, config.robot, config.camera, start, seed, config.world, is_instance_of
    )
    return world, mission


def _difference(less: NDArray[np.float64]) -> str:
    if not less.any():
        return "compared with the others"
    error = less.std(ddof=1) / math.sqrt(len(less)) if len(less) > 1 else math.nan
    return f"{METHODS_COMPARED[0]} less it {less.mean():+.3f} (standard error {error:.3f})"
