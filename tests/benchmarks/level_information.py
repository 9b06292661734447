"""How much the levels tell of where the object is, without the luck of a search's way.

Searches of generated homes, each until the object comes into view. Every ten seconds all viewpoints
that promise something are noted: their level, what they promise, and whether the object is in fact
within 5 m, no way round off, and in the image. A level tells something where its viewpoints find
more, or less, for what they promise than all do.
"""

import dataclasses
import itertools
import math
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.evaluation.catalogue import CatalogueConfig, EpisodeSpec, list_episodes
from ippon.evaluation.goals import matching_instances
from ippon.evaluation.methods import METHODS
from ippon.evaluation.metrics import Judge
from ippon.evaluation.search import Clocks
from ippon.evaluation.trial import Trial, TrialConfig, habitat_trial
from ippon.frame import Frame
from ippon.guidance.levels import Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.mission import Mission
from ippon.mission.snapshot import StepResult
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.scene import Scene
from tests.benchmarks.rows import Row

FIRST_HOME = 2500
LEAST_WAY_M = 3.0
EVERY_FRAMES = 50
LEAST_GAIN = 5.0
"""At the average level: what promises less is left out."""
REACH_M = 5.0
ROUND = 1.25
"""A way this much longer than the straight line leads round a wall, and the object is behind it."""
LONGEST_S = 250.0
NEVER = 0.99999
"""As p_T: the robot explores, and goes nowhere for what it takes for the object."""


class _Viewpoint(NamedTuple):
    time_s: float
    level: int
    promise: float
    finds: bool


def level_rows(homes: int) -> Iterator[Row]:
    """Search one object in each of so many homes, and tell what the levels were worth."""
    base = habitat_trial()
    planner = dataclasses.replace(base.mission.planner, ooi_threshold=NEVER)
    config = dataclasses.replace(
        base,
        mission=dataclasses.replace(base.mission, planner=planner),
        limits=dataclasses.replace(base.limits, max_time_s=LONGEST_S),
    )
    searches = [s for seed in range(FIRST_HOME, FIRST_HOME + homes) if (s := _home(config, seed))]
    total = np.sum([_by_level(search) for search in searches], axis=0)
    finds, gains, share = total[:, 0], total[:, 1], total[:, 2] / len(searches)
    data = f"{len(searches)} searches of generated homes, {FIRST_HOME} on"
    overall = finds.sum() / gains.sum()
    rates = finds / np.maximum(gains, 1e-9) / overall
    for level in sorted(Level, reverse=True):
        name = level.name.lower()
        yield Row(name=f"viewpoints {name}", data=data, value=100.0 * share[level], unit="%")
        yield Row(
            name=f"finds there, for what is promised, {name}",
            data=data,
            value=rates[level],
            unit="x mean",
        )
    told = float((finds * np.log(np.maximum(rates, 1e-3))).sum() / finds.sum())
    yield Row(name="levels tell, a find", data=data, value=told, unit="nat")


def _by_level(search: list[_Viewpoint]) -> NDArray[np.float64]:
    """(4, 3) finds, promises and viewpoints of each level; all searches weigh alike."""
    out = np.zeros((4, 3))
    for viewpoint in search:
        out[viewpoint.level] += (viewpoint.finds, viewpoint.promise, 1.0)
    return out / len(search)


def _home(config: TrialConfig, seed: int) -> list[_Viewpoint]:
    scene = generate_home(seed)
    listed, _ = list_episodes(scene, str(seed), config.robot, CatalogueConfig(seed=5))
    far = [spec for spec in listed if spec.shortest_path_m >= LEAST_WAY_M]
    return _search(config, scene, far[seed % len(far)]) if far else []


def _search(config: TrialConfig, scene: Scene, spec: EpisodeSpec) -> list[_Viewpoint]:
    judge = Judge(scene, config.robot, spec.goal)
    boxes = [scene.instances[k] for k in matching_instances(scene, spec.goal)]
    middles = [0.5 * (np.asarray(b.aabb_min) + np.asarray(b.aabb_max))[:2] for b in boxes]
    half_view = 0.5 * config.robot.horizontal_fov_rad
    levels = config.mission.levels.as_array()
    noted: list[_Viewpoint] = []
    frames = itertools.count(1)

    def finds(x: float, y: float, yaw: float) -> bool:
        for gx, gy in middles:
            straight = math.hypot(gx - x, gy - y)
            off = math.remainder(math.atan2(gy - y, gx - x) - yaw, 2.0 * math.pi)
            if straight < REACH_M and abs(off) < half_view:
                return judge.distance_m((x, y, 0.0)) < ROUND * straight
        return False

    def note(_: Frame, result: StepResult, __: Mission) -> None:
        plan = result.snapshot.plan
        if next(frames) % EVERY_FRAMES or plan is None:
            return
        tree = plan.tree
        for n in range(1, len(tree.gains)):
            level = int(tree.levels[n])
            promise = float(tree.gains[n]) * levels[Level.AVERAGE] / levels[level]
            if promise >= LEAST_GAIN:
                x, y = (float(c) for c in tree.positions_world[n, :2])
                found = finds(x, y, float(tree.yaws_rad[n]))
                noted.append(_Viewpoint(result.snapshot.elapsed_s, level, promise, found))

    clocks = Clocks(wall=time.perf_counter, cpu=time.process_time)
    row = Trial(config, scene, "benchmark", clocks, EmbeddedPrior(), note).run(
        spec, METHODS["ippon"]
    )
    until = row.first_seen_s if row.first_seen_s >= 0.0 else math.inf
    return [viewpoint for viewpoint in noted if viewpoint.time_s < until]
