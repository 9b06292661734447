"""The second day in the same homes, with a third of the small objects moved.

On the first day a robot searches a home for its small objects, one after another. Over night one of
three changes places with another small object of the home. On the second day the robot starts from
elsewhere with the map and the memory of the first, as after a restart, and searches for each object
again; another robot does the same from the same places with an empty map each time.
"""

import dataclasses
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ippon.evaluation.episode_generation import (
    SMALL_GOALS,
    EpisodeGenerationConfig,
    EpisodeSpec,
    list_episodes,
)
from ippon.evaluation.episode_record import EpisodeSetup, TimedPlanner, search
from ippon.evaluation.goal_objects import matching_instances
from ippon.evaluation.methods.method_table import PlannerSetup
from ippon.evaluation.metrics import Judge, Metrics
from ippon.evaluation.trial import TrialConfig, habitat_trial
from ippon.guidance.language.naming import is_instance_of, resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mapping.voxel_map import VoxelMap
from ippon.memory.instance_memory import InstanceMemory
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.mission.places.recollection import Recollection
from ippon.planning.planner import ViewpointPlanner
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.scene import Instance, Scene, StartPose
from ippon.simulation.world import SimulatedWorld
from tests.benchmarks.rows import Row

FIRST_HOME: Final = 4100
OBJECTS_PER_HOME: Final = 3
DAY_NS: Final = 86_400_000_000_000
LONGEST_S: Final = 300.0


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One search of the second day, with memory and without."""

    home: int
    goal: str
    moved: bool
    known: bool
    """It was found on the first day."""
    with_memory: Metrics
    without: Metrics


class Life:
    """A robot in one home, with the map and memory of the days so far."""

    def __init__(self, config: TrialConfig, seed: int) -> None:
        self._config, self._seed = config, seed
        self._prior = EmbeddedPrior()
        self._map = VoxelMap(config.mission.map, config.labels)
        self._memory = InstanceMemory()
        self.now_ns = 1_700_000_000_000_000_000

    def search(self, scene: Scene, goal: str, start: StartPose) -> Metrics:
        """Start the robot and search once."""
        config = self._config
        self._map = restarted(self._map)
        planner = ViewpointPlanner(config.mission.planner, config.robot, self._seed)
        timed = TimedPlanner(planner, time.process_time)
        mission = Mission(
            config.mission, config.robot, self._map.labels, self._seed,
            planner=timed, voxel_map=self._map,
        )  # fmt: skip
        recollection = Recollection(self._map, InstanceMemory(instances=self._memory.instances()))
        resolved = resolve_object(goal.replace("_", " "), config.labels)
        wanted = Goal(goal_id=1, object=goal, display=resolved.display, category=resolved.category)
        mission.goals.set_goal(wanted, self._prior.levels(resolved, "", config.labels))
        assert mission.search is not None
        recollection.begin(mission.search)
        world = SimulatedWorld(
            scene, config.robot, config.camera, start, self._seed, config.world, is_instance_of
        )
        judge = Judge(scene, config.robot, goal)
        began_ns = self.now_ns

        def watch(frame: object, result: object, running: Mission) -> None:
            del frame, result
            self.now_ns = began_ns + world.stamp_ns
            recollection.step(running.search, self.now_ns)

        record = search(
            EpisodeSetup(
                world=world,
                mission=mission,
                planner_setup=PlannerSetup(planner=planner),
                planner=timed,
            ),
            judge, config.limits, time.process_time,
            seen_within_m=config.mission.map.ooi_max_range_m, observer=watch,
        )  # fmt: skip
        self._memory = recollection.memory
        self.now_ns += 60_000_000_000
        return judge.metrics(record.trajectory, stopped=record.ending == "found")


def restarted(voxel_map: VoxelMap) -> VoxelMap:
    """Return a map as a navigator has it that was started again."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "home.map"
        voxel_map.save(path)
        read = VoxelMap.load(path)
    read.set_models(voxel_map.models)
    read.set_ooi(None)
    return read


def swapped(scene: Scene, goal: str, kept: Sequence[str], rng: np.random.Generator) -> Scene | None:
    """Let each object of a kind change places with another small object of the home.

    Args:
        scene: The home.
        goal: The kind.
        kept: Kinds that stay where they are.
        rng: Draws the partners.

    Returns:
        The changed home; None where there are too few others, 2 m and more away.
    """
    mine = matching_instances(scene, goal)
    small = [k for name in SMALL_GOALS for k in matching_instances(scene, name)]
    stay = {k for name in (goal, *kept) for k in matching_instances(scene, name)}
    others = [k for k in dict.fromkeys(small) if k not in stay]
    vertices, instances = scene.vertices.copy(), list(scene.instances)
    for k in mine:
        foot = _foot(scene.instances[k])
        far = [j for j in others if np.linalg.norm(_foot(scene.instances[j]) - foot) >= 2.0]
        if not far:
            return None
        other = int(rng.choice(far))
        others.remove(other)
        way = _foot(scene.instances[other]) - foot
        for moved, by in ((k, way), (other, -way)):
            rows = np.unique(scene.faces[scene.face_instance == moved])
            vertices[rows] += by.astype(np.float32)
            instances[moved] = _shifted(instances[moved], by)
    return dataclasses.replace(scene, vertices=vertices, instances=tuple(instances))


def _foot(one: Instance) -> np.ndarray:
    low, high = np.array(one.aabb_min), np.array(one.aabb_max)
    return np.array([*(0.5 * (low + high))[:2], low[2]])


def _shifted(one: Instance, by: np.ndarray) -> Instance:
    low, high = (tuple(float(x) for x in np.add(c, by)) for c in (one.aabb_min, one.aabb_max))
    return dataclasses.replace(one, aabb_min=low, aabb_max=high)


def pairs_of(config: TrialConfig, seed: int) -> Iterator[Pair]:
    """Live two days in a home."""
    scene = generate_home(seed)
    catalogue = EpisodeGenerationConfig(
        goals=SMALL_GOALS, small_per_home=OBJECTS_PER_HOME, min_shortest_path_m=2.0, seed=seed
    )
    specs: tuple[EpisodeSpec, ...] = list_episodes(scene, str(seed), config.robot, catalogue)[0]
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(specs)).tolist()
    later, moved = scene, ""
    for k in order:
        changed = swapped(scene, specs[k].goal, [spec.goal for spec in specs], rng)
        if changed is not None:
            later, moved = changed, specs[k].goal
            break
    life = Life(config, seed)
    starts = [specs[(k + 1) % len(specs)].start for k in range(len(specs))]
    known = {
        spec.goal: life.search(scene, spec.goal, start).success
        for spec, start in zip(specs, starts, strict=True)
    }
    life.now_ns += DAY_NS
    for spec in specs:
        remembered = life.search(later, spec.goal, spec.start)
        fresh = Life(config, seed).search(later, spec.goal, spec.start)
        yield Pair(
            home=seed,
            goal=spec.goal,
            moved=spec.goal == moved,
            known=known[spec.goal],
            with_memory=remembered,
            without=fresh,
        )


def second_day_rows(pairs: int) -> Iterator[Row]:
    """Measure so many pairs; each is told on standard error as it is done."""
    config = habitat_trial()
    limits = dataclasses.replace(config.limits, max_time_s=LONGEST_S)
    config = dataclasses.replace(config, limits=limits)
    done: list[Pair] = []
    seed = FIRST_HOME
    while len(done) < pairs:
        for pair in pairs_of(config, seed):
            done.append(pair)
            sys.stderr.write(f"{pair}\n")
            sys.stderr.flush()
        seed += 1
    for name, part in (
        ("all", done),
        ("moved", [p for p in done if p.moved]),
        ("not moved", [p for p in done if not p.moved]),
    ):
        if part:
            yield from _rows(name, part)


def _rows(name: str, part: list[Pair]) -> Iterator[Row]:
    data = f"{name}: {len(part)} pairs in {len({p.home for p in part})} homes"
    for arm in ("with_memory", "without"):
        all_of = [getattr(p, arm) for p in part]
        success = float(np.mean([m.success for m in all_of]))
        way = float(np.mean([m.path_length_m for m in all_of]))
        yield Row(name=f"success, {arm}", data=data, value=success, unit="")
        yield Row(name=f"way, {arm}", data=data, value=way, unit="m")
    with_m = sum(p.with_memory.path_length_m for p in part)
    without_m = sum(p.without.path_length_m for p in part)
    yield Row(name="way with memory / without", data=data, value=with_m / without_m, unit="")
