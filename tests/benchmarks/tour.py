"""Three objects in one tour, against three searches one after another on one map.

In each unseen home a robot is asked for three small objects. In one arm it searches for them in the
order in which they were named, each search with map and roadmap of those before, and goes on where
the last one ended; in the other it searches for all of them at once.
"""

import dataclasses
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from ippon.evaluation.episode import run_episode
from ippon.evaluation.episode_generation import (
    SMALL_GOALS,
    EpisodeGenerationConfig,
    EpisodeSpec,
    list_episodes,
)
from ippon.evaluation.metrics import Judge
from ippon.evaluation.trial import TrialConfig, habitat_trial
from ippon.frame import Frame
from ippon.guidance.language.naming import is_instance_of, resolve_object
from ippon.guidance.levels import Guidance
from ippon.guidance.prior import EmbeddedPrior
from ippon.mapping.config import MapConfig
from ippon.mapping.goal_layers.goal_layers import GoalLayers, OoiTarget
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.mission.snapshot import GoalState, MissionState
from ippon.observation import Heatmap
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.scene import Scene
from ippon.simulation.world import SimulatedWorld
from ippon.vocabulary import MATTERPORT_40
from tests.benchmarks import frames
from tests.benchmarks.rows import Row

FIRST_HOME: Final = 6100
GOALS: Final = 3
LONGEST_S: Final = 300.0
"""Robot time for one search; a tour has three times as much."""


@dataclass(frozen=True, kw_only=True)
class Arm:
    """What one robot did in one home."""

    found: int
    """Goals that it was right about."""
    way_m: float
    time_s: float
    cpu_s: float


@dataclass(frozen=True, kw_only=True)
class Home:
    """Both arms in one home."""

    seed: int
    goals: tuple[str, ...]
    tour: Arm
    sequence: Arm


class Robot:
    """A robot in a home, with what it is asked for."""

    def __init__(self, config: TrialConfig, scene: Scene, spec: EpisodeSpec, seed: int) -> None:
        self.world = SimulatedWorld(
            scene, config.robot, config.camera, spec.start, seed, config.world, is_instance_of
        )
        self.mission = Mission(config.mission, config.robot, config.labels, seed)
        self._config, self._scene, self._prior = config, scene, EmbeddedPrior()
        self.right: set[str] = set()

    def wanted(self, name: str, goal_id: int) -> tuple[Goal, Guidance]:
        """Return a goal with its levels."""
        resolved = resolve_object(name.replace("_", " "), self._config.labels)
        goal = Goal(
            goal_id=goal_id, object=name, display=resolved.display, category=resolved.category
        )
        return goal, self._prior.levels(resolved, "", self._config.labels)

    def run(self, max_time_s: float) -> None:
        """Search until everything was found, nothing is left to see, or time is up."""
        limits = dataclasses.replace(self._config.limits, max_time_s=max_time_s)
        announced: set[str] = set()
        for result in run_episode(self.world, self.mission, limits):
            shot = result.snapshot
            found = {one.goal.object for one in shot.tour if one.state is GoalState.FOUND}
            if shot.state is MissionState.FOUND and shot.goal is not None:
                found.add(shot.goal.object)
            for name in found - announced:
                judge = Judge(self._scene, self._config.robot, name)
                if judge.metrics(self.world.trajectory, stopped=True).success:
                    self.right.add(name)
            announced |= found


def arm_of(
    config: TrialConfig, scene: Scene, specs: tuple[EpisodeSpec, ...], seed: int, *, tour: bool
) -> Arm:
    """Search for the goals of some episodes from the start of the first."""
    robot, began = Robot(config, scene, specs[0], seed), time.process_time()
    goals = [robot.wanted(spec.goal, n + 1) for n, spec in enumerate(specs)]
    if tour:
        robot.mission.goals.set_goals(goals)
        robot.run(len(goals) * LONGEST_S)
    else:
        for goal, guidance in goals:
            robot.mission.goals.set_goal(goal, guidance)
            robot.run(LONGEST_S)
    return Arm(
        found=len(robot.right),
        way_m=robot.world.path_length_m(),
        time_s=robot.world.stamp_ns * 1e-9,
        cpu_s=time.process_time() - began,
    )


def home_of(config: TrialConfig, seed: int) -> Home | None:
    """Return both arms in a home; None for a home with too few objects."""
    scene = generate_home(seed)
    catalogue = EpisodeGenerationConfig(
        goals=SMALL_GOALS, small_per_home=GOALS, min_shortest_path_m=2.0, seed=seed
    )
    specs = list_episodes(scene, str(seed), config.robot, catalogue)[0]
    if len(specs) < GOALS or len({spec.goal for spec in specs[:GOALS]}) < GOALS:
        return None
    specs = specs[:GOALS]
    return Home(
        seed=seed,
        goals=tuple(spec.goal for spec in specs),
        tour=arm_of(config, scene, specs, seed, tour=True),
        sequence=arm_of(config, scene, specs, seed, tour=False),
    )


def tour_rows(homes: int) -> Iterator[Row]:
    """Measure so many homes; each is told on standard error as it is done."""
    yield from layer_rows()
    config = habitat_trial()
    done: list[Home] = []
    seed = FIRST_HOME
    while len(done) < homes:
        home = home_of(config, seed)
        seed += 1
        if home is not None:
            done.append(home)
            sys.stderr.write(f"{home}\n")
            sys.stderr.flush()
    yield from _rows("all", done)
    both = [h for h in done if h.tour.found == h.sequence.found == GOALS]
    if both:
        yield from _rows("all three found by both", both)


def _rows(name: str, part: list[Home]) -> Iterator[Row]:
    data = f"{name}: {len(part)} homes"
    for arm in ("tour", "sequence"):
        arms: list[Arm] = [getattr(home, arm) for home in part]
        right = sum(one.found for one in arms) / (GOALS * len(arms))
        yield Row(name=f"found, {arm}", data=data, value=right, unit="")
        yield Row(name=f"way, {arm}", data=data, value=_mean([a.way_m for a in arms]), unit="m")
        yield Row(name=f"time, {arm}", data=data, value=_mean([a.time_s for a in arms]), unit="s")
    for what in ("way_m", "time_s"):
        mine = np.array([getattr(home.tour, what) for home in part])
        theirs = np.array([getattr(home.sequence, what) for home in part])
        ratio = float(mine.sum() / theirs.sum())
        # Of a ratio of sums, by linearisation.
        error = float(np.std(mine - ratio * theirs) / theirs.mean() / math.sqrt(len(part)))
        title = f"{what.split('_')[0]}, tour / sequence"
        note = f"standard error {error:.2f}"
        yield Row(name=title, data=data, value=ratio, unit="", note=note)


def _mean(values: list[float]) -> float:
    return float(np.mean(values))


def layer_rows() -> Iterator[Row]:
    """Measure a map's update with 1 to 8 objects of interest, from images of a generated home."""
    images = frames.available(60)["home"]
    names = [f"goal_{n}" for n in range(8)]
    median: dict[int, float] = {}
    for count in (0, 1, 2, 4, 8):
        median[count] = _update_ms(images, names[:count])
        title = "map update, its only object" if count == 0 else f"map update, {count} of a tour"
        yield Row(name=title, data="home", voxel_size_m=0.1, median_ms=median[count])
    more = (median[8] - median[1]) / 7
    yield Row(name="each further object of a tour", data="home", voxel_size_m=0.1, median_ms=more)


def _update_ms(images: list[Frame], goals: list[str]) -> float:
    """Return the median time of an update with some goals; without, with the map's one object."""
    shown = [_with_goals(frame, goals or ["goal_0"]) for frame in images]
    times: list[float] = []
    for _ in range(2):  # The kernels are compiled in the first round.
        voxel_map = VoxelMap(MapConfig(), MATTERPORT_40)
        if goals:
            GoalLayers(voxel_map, [OoiTarget(label=name) for name in goals])
        else:
            voxel_map.set_ooi("goal_0")
        times = []
        for frame in shown:
            began = time.process_time()
            voxel_map.integrate(frame)
            times.append(1e3 * (time.process_time() - began))
    return float(np.median(times))


def _with_goals(frame: Frame, goals: list[str]) -> Frame:
    """Return a frame whose heatmap has a channel for each goal, a copy of a common label's."""
    heat = frame.heatmap
    assert heat is not None, "the frames of a home have heatmaps"
    p = heat.probabilities[..., : len(heat.labels)]
    p = np.concatenate([p, p[..., : len(goals)]], axis=2)
    labels = (*heat.labels, *goals[1:])
    more = Heatmap(labels=labels, ooi=goals[0], probabilities=p, kind=heat.kind)
    return dataclasses.replace(frame, heatmap=more)
