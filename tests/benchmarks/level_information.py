"""How much levels and images tell of where the object is, without a single way's luck.

Searches of homes, each until the object comes into view. Every ten seconds all viewpoints that
promise something are noted: what they promise at the average level, what is known of their level,
and whether the object is in fact within 5 m, no way round off, and in the image. What is known
makes some promise more and some less. It tells something if the share of all that is promised
which lies at viewpoints that would find the object grows: the log of that share, in nat, averaged
over the moments of a search and then over searches, is compared with and without it.
"""

import dataclasses
import itertools
import math
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.evaluation.episode_generation import EpisodeGenerationConfig, EpisodeSpec, list_episodes
from ippon.evaluation.episode_record import Clocks
from ippon.evaluation.goal_objects import matching_instances
from ippon.evaluation.methods.method_table import METHODS
from ippon.evaluation.metrics import Judge
from ippon.evaluation.trial import Trial, TrialConfig, habitat_trial
from ippon.frame import Frame
from ippon.guidance.levels import Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.mission import Mission
from ippon.mission.snapshot import StepResult
from ippon.planning.visibility.viewpoint_gain import imagined_level, with_evidence
from ippon.planning.visibility.viewpoint_store import ViewpointStore
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
LEAST_SHARE = 1e-3


class Noted(NamedTuple):
    """A viewpoint at one moment of a search."""

    time_s: float
    level: int
    nat: float
    """What images tell of what it looks at."""
    promise: float
    """Gain at the average level, without what images tell."""
    finds: bool


Model = Callable[[Noted], float]


def level_rows(homes: int) -> Iterator[Row]:
    """Search one object in each of so many homes, and tell what the levels were worth.

    Half as many small objects are searched for with a true sentence about where they are.
    """
    config = exploring(habitat_trial())
    searches = [s for seed in range(FIRST_HOME, FIRST_HOME + homes) if (s := _home(config, seed))]
    data = f"{len(searches)} searches of generated homes, {FIRST_HOME} on"
    yield from _rows_by_level(searches, data)
    p = config.mission.levels.as_array().astype(np.float64)
    average = float(p[Level.AVERAGE])

    def by_level(n: Noted) -> float:
        return float(p[n.level]) / average

    nothing = _scores(searches, lambda _: 1.0)
    levels = _scores(searches, by_level)
    images = _scores(searches, lambda n: float(with_evidence(average, n.nat)) / average)
    both = _scores(searches, lambda n: float(with_evidence(p[n.level], n.nat)) / average)
    seeds = range(FIRST_HOME, FIRST_HOME + max(1, homes // 2))
    told = [s for seed in seeds if (s := _home(config, seed, told=True))]
    with_context = _scores(told, by_level) - _scores(told, lambda _: 1.0)
    yield Row(
        name="share of what is promised that would find the object",
        data=data,
        value=100.0 * math.exp(nothing.mean()),
        unit="% (geometric mean)",
    )
    of_told = f"{len(told)} searches for small objects, {FIRST_HOME} on"
    for name, what, gain in (
        ("levels add", data, levels - nothing),
        ("images add", data, images - nothing),
        ("images add to levels", data, both - levels),
        ("levels with a true context add", of_told, with_context),
    ):
        if not len(gain):
            continue
        spread = gain.std(ddof=1) / math.sqrt(len(gain)) if len(gain) > 1 else math.nan
        note = f"standard error {spread:.3f}"
        yield Row(name=name, data=what, value=float(gain.mean()), unit="nat", note=note)


def _scores(searches: list[list[Noted]], model: Model) -> NDArray[np.float64]:
    return np.array([s for search in searches if (s := score(search, model)) is not None])


def _rows_by_level(searches: list[list[Noted]], data: str) -> Iterator[Row]:
    total = np.sum([_by_level(search) for search in searches], axis=0)
    finds, gains, share = total[:, 0], total[:, 1], total[:, 2] / len(searches)
    rates = finds / np.maximum(gains, 1e-9) / (finds.sum() / gains.sum())
    for level in sorted(Level, reverse=True):
        name = level.text
        yield Row(name=f"viewpoints {name}", data=data, value=100.0 * share[level], unit="%")
        yield Row(
            name=f"finds there, for what is promised, {name}",
            data=data,
            value=rates[level],
            unit="x mean",
        )


def exploring(base: TrialConfig) -> TrialConfig:
    """Return a set-up whose robot explores for a while and goes nowhere for the object."""
    planner = dataclasses.replace(base.mission.planner, ooi_threshold=NEVER)
    return dataclasses.replace(
        base,
        mission=dataclasses.replace(base.mission, planner=planner),
        limits=dataclasses.replace(base.limits, max_time_s=LONGEST_S),
    )


def score(search: list[Noted], model: Model) -> float | None:
    """Return the mean log share, nat, of what a model promises where the object would be found.

    None where at no moment any viewpoint would have found it.
    """
    out: list[float] = []
    for _, moment in itertools.groupby(search, key=lambda n: n.time_s):
        noted = list(moment)
        promise = np.array([n.promise * model(n) for n in noted])
        finds = np.array([n.finds for n in noted])
        if finds.any():
            out.append(math.log(max(LEAST_SHARE, promise[finds].sum() / promise.sum())))
    return sum(out) / len(out) if out else None


def _by_level(search: list[Noted]) -> NDArray[np.float64]:
    """(4, 3) finds, promises and viewpoints of each level; all searches weigh alike."""
    out = np.zeros((4, 3))
    for noted in search:
        out[noted.level] += (noted.finds, noted.promise, 1.0)
    return out / len(search)


def _home(config: TrialConfig, seed: int, *, told: bool = False) -> list[Noted]:
    scene = generate_home(seed)
    catalogue = EpisodeGenerationConfig(seed=5, context="support" if told else "none")
    listed, _ = list_episodes(scene, str(seed), config.robot, catalogue)
    far = [
        spec
        for spec in listed
        if spec.shortest_path_m >= LEAST_WAY_M and bool(spec.context) == told
    ]
    return note_viewpoints(config, scene, far[seed % len(far)]) if far else []


def note_viewpoints(config: TrialConfig, scene: Scene, spec: EpisodeSpec) -> list[Noted]:
    """Search, and return the viewpoints of every tenth second until the object is in view."""
    judge = Judge(scene, config.robot, spec.goal)
    boxes = [scene.instances[k] for k in matching_instances(scene, spec.goal)]
    middles = [0.5 * (np.asarray(b.aabb_min) + np.asarray(b.aabb_max))[:2] for b in boxes]
    half_view = 0.5 * config.robot.horizontal_fov_rad
    average = float(config.mission.levels.as_array()[Level.AVERAGE])
    noted: list[Noted] = []
    frames = itertools.count(1)

    def finds(x: float, y: float, yaw: float) -> bool:
        for gx, gy in middles:
            straight = math.hypot(gx - x, gy - y)
            off = math.remainder(math.atan2(gy - y, gx - x) - yaw, 2.0 * math.pi)
            if straight < REACH_M and abs(off) < half_view:
                return judge.distance_m((x, y, 0.0)) < ROUND * straight
        return False

    def note(frame: Frame, result: StepResult, mission: Mission) -> None:
        if next(frames) % EVERY_FRAMES:
            return
        views: ViewpointStore = mission._planner._planner._viewpoints  # pyright: ignore
        time_s = result.snapshot.elapsed_s
        for node, sums in views._sums.items():
            heading = int(np.argmin(np.abs(views.geometry.orientations.yaws - views.yaw[node])))
            promise = float((sums.known[heading] + average * sums.unknown[heading]).max())
            if promise < LEAST_GAIN:
                continue
            level = int(imagined_level(sums.levels[heading], views.config.min_level_voxels))
            x, y = (float(c) for c in views._at[node])
            nat = float(views.far_evidence_nat[node, heading])
            found = finds(x, y, float(views.yaw[node]))
            noted.append(Noted(time_s, level, nat, promise, found))

    clocks = Clocks(wall=time.perf_counter, cpu=time.process_time)
    trial = Trial(config, scene, "benchmark", clocks, EmbeddedPrior(), note)
    row = trial.run(spec, METHODS["ippon"])
    until = row.first_seen_s if row.first_seen_s >= 0.0 else math.inf
    return [viewpoint for viewpoint in noted if viewpoint.time_s < until]
