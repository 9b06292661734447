"""Runs one episode with one method and writes down how it went."""

import dataclasses
import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.evaluation.catalogue import EpisodeSpec
from ippon.evaluation.episode import EpisodeLimits, run_episode
from ippon.evaluation.methods import Equipment, Method, Situation
from ippon.evaluation.metrics import Judge
from ippon.evaluation.outcome import (
    Ending,
    failure_cause,
    is_at_instance,
    shows_object,
    stood_still,
)
from ippon.evaluation.row import EpisodeRow
from ippon.geometry import Float64Array
from ippon.guidance.naming import is_instance_of, resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mapping.arrays import MapArrays
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission, MissionConfig
from ippon.mission.snapshot import MissionState, Snapshot
from ippon.planning.interface import Planner
from ippon.planning.plan import Plan
from ippon.robot import HABITAT, RobotProfile
from ippon.simulation.robot import BaseConfig
from ippon.simulation.scene import Scene
from ippon.simulation.world import SimulatedWorld, WorldConfig
from ippon.vocabulary import MATTERPORT_40

Clock = Callable[[], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialConfig:
    """Everything that all methods share."""

    robot: RobotProfile = HABITAT
    image_width: int = 240
    """Half of the challenge's 480 x 640: the same for every method."""
    limits: EpisodeLimits = field(default_factory=EpisodeLimits)
    world: WorldConfig = field(default_factory=WorldConfig)
    mission: MissionConfig = field(default_factory=MissionConfig)
    labels: tuple[str, ...] = MATTERPORT_40

    @property
    def camera(self) -> PinholeCamera:
        """The robot's camera at this image size."""
        return PinholeCamera.from_horizontal_fov(
            self.image_width,
            round(self.image_width / self.robot.image_aspect),
            self.robot.horizontal_fov_rad,
        )


def habitat_trial(image_width: int = 240) -> TrialConfig:
    """Return the set-up of the Habitat ObjectNav Challenge 2023.

    Steps of 0.1 s, 500 s, no sliding, noise-free colour, depth and pose; an image every second
    step, in which the robot moves at most 6 cm and turns 5 degrees.
    """
    world = WorldConfig(base=BaseConfig(sliding=False))
    limits = EpisodeLimits(time_step_s=0.1, steps_per_frame=2, max_time_s=500.0)
    return TrialConfig(robot=HABITAT, image_width=image_width, limits=limits, world=world)


def config_hash(config: TrialConfig, method: Method) -> str:
    """Return twelve hexadecimal digits that differ wherever two set-ups do."""
    shown = {
        "trial": dataclasses.asdict(
            dataclasses.replace(config, mission=method.configure(config.mission))
        ),
        "method": method.name,
    }
    return hashlib.sha256(json.dumps(shown, sort_keys=True).encode()).hexdigest()[:12]


@dataclass(frozen=True, slots=True, kw_only=True)
class Clocks:
    """Where time is read from; the library has no clock of its own."""

    wall: Clock
    """Seconds."""
    cpu: Clock
    """Seconds of processor time of this process."""


class _TimedPlanner:
    """Hands everything on and notes how long a step took."""

    def __init__(self, planner: Planner, cpu: Clock) -> None:
        self._planner = planner
        self._cpu = cpu
        self.seconds: list[float] = []

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        self._planner.set_goal(probabilities=probabilities, termination_min=termination_min)

    def mark_contact(self, T_world_base: Float64Array) -> None:
        self._planner.mark_contact(T_world_base)

    def step(self, map_arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> Plan:
        began = self._cpu()
        plan = self._planner.step(map_arrays, T_world_base, tilt_rad)
        self.seconds.append(self._cpu() - began)
        return plan


@dataclass(slots=True, kw_only=True)
class _Record:
    """What is noted from frame to frame."""

    positions: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    step_s: list[float] = field(default_factory=list[float])
    first_seen_s: float = -1.0
    last: Snapshot | None = None


class Trial:
    """Runs episodes in one scene under one configuration."""

    def __init__(
        self, config: TrialConfig, scene: Scene, version: str, clocks: Clocks, prior: EmbeddedPrior
    ) -> None:
        self._config = config
        self._scene = scene
        self._version = version
        self._clocks = clocks
        self._prior = prior
        self._judges: dict[str, Judge] = {}

    def run(self, spec: EpisodeSpec, method: Method) -> EpisodeRow:
        """Search once."""
        config, clocks = self._config, self._clocks
        began_wall, began_cpu = clocks.wall(), clocks.cpu()
        judge = self._judge(spec.goal)
        mission, equipment, timed = self._prepare(spec, method, judge)
        world = SimulatedWorld(
            self._scene, config.robot, config.camera, spec.start, spec.seed, config.world,
            is_instance_of,
        )  # fmt: skip
        record = _Record()
        before = clocks.cpu()
        # The generator runs observe, watch and the mission's step; the step alone is timed by
        # taking the clock when the frame is handed over.
        handed_over = [before]

        def watch(frame: Any) -> None:
            if equipment.observe is not None:
                equipment.observe(frame)
            handed_over[0] = clocks.cpu()

        for result in run_episode(world, mission, config.limits, watch):
            record.step_s.append(clocks.cpu() - handed_over[0])
            record.last = result.snapshot
            record.positions.append((world.base.x_m, world.base.y_m))
            self._look(world, judge, record)
        return self._row(
            spec, method, judge, world, record, timed,
            wall_s=clocks.wall() - began_wall, cpu_s=clocks.cpu() - began_cpu,
        )  # fmt: skip

    def _judge(self, goal: str) -> Judge:
        if goal not in self._judges:
            self._judges[goal] = Judge(self._scene, self._config.robot, goal)
        return self._judges[goal]

    def _prepare(
        self, spec: EpisodeSpec, method: Method, judge: Judge
    ) -> tuple[Mission, Equipment, _TimedPlanner]:
        config = self._config
        mission_config = method.configure(config.mission)
        resolved = resolve_object(spec.goal.replace("_", " "), config.labels)
        guidance = method.guide(self._prior.levels(resolved, spec.context, config.labels))
        equipment = method.equip(
            Situation(
                config=mission_config,
                robot=config.robot,
                guidance=guidance,
                seed=spec.seed,
                scene=self._scene,
                judge=judge,
                goal=spec.goal,
            )
        )
        timed = _TimedPlanner(equipment.planner, self._clocks.cpu)
        mission = Mission(mission_config, config.robot, config.labels, spec.seed, planner=timed)
        goal = Goal(
            goal_id=1,
            object=spec.goal,
            display=resolved.display,
            context=spec.context,
            category=resolved.category,
        )
        mission.set_goal(goal, guidance)
        return mission, equipment, timed

    def _look(self, world: SimulatedWorld, judge: Judge, record: _Record) -> None:
        """Note when the object first came into view."""
        if record.first_seen_s >= 0.0 or world.rendering is None:
            return
        reach = min(self._config.mission.map.ooi_max_range_m, self._config.robot.max_depth_m)
        if shows_object(world.rendering, judge.instances, reach):
            record.first_seen_s = round(world.stamp_ns * 1e-9, 3)

    def _row(
        self,
        spec: EpisodeSpec,
        method: Method,
        judge: Judge,
        world: SimulatedWorld,
        record: _Record,
        timed: _TimedPlanner,
        *,
        wall_s: float,
        cpu_s: float,
    ) -> EpisodeRow:
        config, last = self._config, record.last
        assert last is not None, "an episode has at least one frame"
        ending = _ending(last.state)
        metrics = judge.metrics(world.trajectory, stopped=ending == "found")
        instances = [self._scene.instances[k] for k in judge.instances]
        frame_s = config.limits.time_step_s * config.limits.steps_per_frame
        failure = failure_cause(
            success=metrics.success,
            ending=ending,
            seen=record.first_seen_s >= 0.0,
            recognised=any(is_at_instance(c, instances) for c in last.candidates),
            stuck=ending == "time" and stood_still(np.array(record.positions), frame_s),
        )
        time_s = world.stamp_ns * 1e-9
        path = _thinned(world.trajectory[:, :2])
        planner_ms = 1e3 * np.array(timed.seconds or [0.0])
        return EpisodeRow(
            episode_id=spec.episode_id,
            method=method.name,
            home=spec.home,
            start_index=spec.start_index,
            start_x_m=spec.start.x,
            start_y_m=spec.start.y,
            start_yaw_rad=spec.start.yaw,
            goal=spec.goal,
            context=spec.context,
            seed=spec.seed,
            robot=config.robot.name,
            image_width=config.camera.width,
            image_height=config.camera.height,
            config_hash=config_hash(config, method),
            version=self._version,
            success=metrics.success,
            spl=metrics.spl,
            soft_spl=metrics.soft_spl,
            path_length_m=metrics.path_length_m,
            shortest_path_m=metrics.shortest_path_m,
            distance_to_goal_m=metrics.distance_to_goal_m,
            ending=ending,
            failure=failure,
            time_s=round(time_s, 3),
            frames=world.frames,
            hits=world.collisions,
            first_seen_s=record.first_seen_s,
            explored_m2=last.explored_m2,
            best_ooi=last.best_ooi,
            candidates=len(last.candidates),
            path_x_m=tuple(path[:, 0].tolist()),
            path_y_m=tuple(path[:, 1].tolist()),
            planner_ms_p50=float(np.percentile(planner_ms, 50)),
            planner_ms_p95=float(np.percentile(planner_ms, 95)),
            step_ms_p50=1e3 * float(np.median(record.step_s)),
            wall_s=wall_s,
            cpu_s=cpu_s,
            realtime_factor=time_s / max(cpu_s, 1e-9),
        )


def _ending(state: MissionState) -> Ending:
    if state is MissionState.FOUND:
        return "found"
    return "exhausted" if state is MissionState.EXHAUSTED else "time"


def _thinned(path: Float64Array, step_m: float = 0.1) -> Float64Array:
    """Keep a point about every `step_m`, rounded to a centimetre, first and last included."""
    kept = [path[0]]
    for point in path[1:-1]:
        if float(np.linalg.norm(point - kept[-1])) >= step_m:
            kept.append(point)
    if len(path) > 1:
        kept.append(path[-1])
    return np.round(np.array(kept, dtype=np.float64), 2)
