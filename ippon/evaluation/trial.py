"""One episode with one method, and its row."""

import dataclasses
import hashlib
import json
from dataclasses import dataclass, field

import numpy as np

from ippon.camera import PinholeCamera
from ippon.evaluation.episode import EpisodeLimits
from ippon.evaluation.episode_generation import EpisodeSpec
from ippon.evaluation.episode_record import (
    Clocks,
    EpisodeSetup,
    FrameObserver,
    SearchRecord,
    TimedPlanner,
    search,
)
from ippon.evaluation.methods.method_table import Method, PlannerInputs
from ippon.evaluation.metrics import Judge
from ippon.evaluation.outcome import failure_cause, stood_still, touched_there
from ippon.evaluation.row import EpisodeRow
from ippon.geometry import Float64Array
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.naming import is_instance_of, resolve_object
from ippon.guidance.levels import Guidance
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.config import MissionConfig
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.robot import HABITAT, RobotProfile
from ippon.simulation.robot.mobile_base import BaseConfig, camera_of
from ippon.simulation.scene import Scene, StartPose
from ippon.simulation.world import SimulatedWorld, WorldConfig
from ippon.vocabulary import MATTERPORT_40, in_words


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialConfig:
    """Configuration that all methods share."""

    robot: RobotProfile = HABITAT
    image_width: int = 240
    """Half of the challenge's 480 x 640; the same for every method. Larger shows smaller objects
    and costs time."""
    limits: EpisodeLimits = field(default_factory=EpisodeLimits)
    world: WorldConfig = field(default_factory=WorldConfig)
    mission: MissionConfig = field(default_factory=MissionConfig)
    labels: tuple[str, ...] = MATTERPORT_40

    @property
    def camera(self) -> PinholeCamera:
        """The robot's camera at this image size."""
        return camera_of(self.robot, self.image_width)


def habitat_trial(image_width: int = 240) -> TrialConfig:
    """Return the set-up of the Habitat ObjectNav Challenge 2023.

    Steps of 0.1 s, 500 s, no sliding, an exact pose; an image every second step, in which the
    robot moves at most 6 cm and turns 5 degrees. Unlike in the challenge, colour and depth are
    noisy and the segmentation has errors; see `WorldConfig`.
    """
    world = WorldConfig(base=BaseConfig(sliding=False))
    limits = EpisodeLimits(time_step_s=0.1, steps_per_frame=2, max_time_s=500.0)
    return TrialConfig(robot=HABITAT, image_width=image_width, limits=limits, world=world)


def config_hash(config: TrialConfig, method: Method) -> str:
    """Return twelve hexadecimal digits that identify a set-up."""
    trial = dataclasses.asdict(
        dataclasses.replace(config, mission=method.configure(config.mission))
    )
    if trial["mission"]["planner"]["step_budget_s"] is None:
        # Omitted when unset, so that hashes of earlier runs stay valid.
        del trial["mission"]["planner"]["step_budget_s"]
    if config.world.segmentation_errors == "paper":
        # Omitted at its earlier value, for the same reason.
        del trial["world"]["segmentation_errors"], trial["world"]["detector"]
    if config.world.attribute_errors.rate == 0.0:
        del trial["world"]["attribute_errors"]
    shown = {"trial": trial, "method": method.name}
    return hashlib.sha256(json.dumps(shown, sort_keys=True).encode()).hexdigest()[:12]


class Trial:
    """Runs episodes in one scene under one configuration."""

    def __init__(
        self,
        config: TrialConfig,
        scene: Scene,
        version: str,
        clocks: Clocks,
        prior: EmbeddedPrior,
        observer: FrameObserver | None = None,
    ) -> None:
        """Store what all episodes share.

        Args:
            config: Robot, camera, world and mission.
            scene: The home.
            version: Version column of the rows.
            clocks: Time sources.
            prior: Source of levels.
            observer: Called with every step of every search, or None.
        """
        self._config = config
        self._scene = scene
        self._version = version
        self._clocks = clocks
        self._prior = prior
        self._witness = observer
        self._judges: dict[tuple[str, str], Judge] = {}

    def run(self, spec: EpisodeSpec, method: Method) -> EpisodeRow:
        """Run one search; `spec.then` is ignored."""
        return self._run_first(spec, method)[0]

    def run_all(self, spec: EpisodeSpec, method: Method) -> tuple[EpisodeRow, ...]:
        """Run one search, or three with `spec.then`: first, second, and second with an empty map.

        Returns:
            The rows named by `spec.row_ids`: the search; the second search, on the map and from the
            end of the first; one from there with an empty map.

        Raises:
            ValueError: The method does not support a second goal.
        """
        if spec.then and not method.supports_second_goal:
            raise ValueError(f"{method.name} searches for one object only")
        row, setup = self._run_first(spec, method)
        if not spec.then:
            return (row,)
        second_id, fresh_id = spec.row_ids[1:]
        base = setup.world.base
        start = StartPose(x=base.x_m, y=base.y_m, z=base.z_m, yaw=base.yaw_rad)
        later = dataclasses.replace(
            spec, goal=spec.then, start=start, context="", colour="", then=""
        )
        began = self._begin(later)
        setup.mission.goals.set_goal(*self._goal(later, method, goal_id=2))
        second = self._row(second_id, later, method, self._search(setup, later), began)
        began = self._begin(later)
        setup = self._setup(later, method)
        fresh = self._row(fresh_id, later, method, self._search(setup, later), began)
        return (
            row,
            dataclasses.replace(second, kind="second", after=spec.goal),
            dataclasses.replace(fresh, kind="fresh", after=spec.goal),
        )

    def guidance(self, spec: EpisodeSpec, method: Method) -> Guidance:
        """Return the levels of the search."""
        return self._goal(spec, method)[1]

    def _run_first(self, spec: EpisodeSpec, method: Method) -> tuple[EpisodeRow, EpisodeSetup]:
        began = self._begin(spec)
        setup = self._setup(spec, method)
        return self._row(spec.episode_id, spec, method, self._search(setup, spec), began), setup

    def _begin(self, spec: EpisodeSpec) -> tuple[float, float]:
        """Return wall and processor time at the begin of a search."""
        # All methods use one judge: the first would pay for it.
        self._judge(spec)
        return self._clocks.wall(), self._clocks.cpu()

    def _judge(self, spec: EpisodeSpec) -> Judge:
        key = spec.goal, spec.colour
        if key not in self._judges:
            robot = self._config.robot
            self._judges[key] = Judge(self._scene, robot, spec.goal, colour=spec.colour)
        return self._judges[key]

    def _goal(self, spec: EpisodeSpec, method: Method, goal_id: int = 1) -> tuple[Goal, Guidance]:
        resolved = resolve_object(in_words(spec.goal), self._config.labels)
        guidance = method.guide(self._prior.levels(resolved, spec.context, self._config.labels))
        goal = Goal(
            goal_id=goal_id,
            object=spec.goal,
            display=resolved.display,
            context=spec.context,
            category=resolved.category,
            attributes=(Attribute(kind="colour", value=spec.colour),) if spec.colour else (),
        )
        return goal, guidance

    def _setup(self, spec: EpisodeSpec, method: Method) -> EpisodeSetup:
        """Place a robot with an empty map at the start."""
        config = self._config
        mission_config = method.configure(config.mission)
        goal, guidance = self._goal(spec, method)
        planner_setup = method.make_planner(
            PlannerInputs(
                config=mission_config,
                robot=config.robot,
                guidance=guidance,
                seed=spec.seed,
                scene=self._scene,
                judge=self._judge(spec),
                goal=spec.goal,
                parameters=method.parameters,
            )
        )
        timed = TimedPlanner(planner_setup.planner, self._clocks.cpu)
        mission = Mission(mission_config, config.robot, config.labels, spec.seed, planner=timed)
        mission.goals.set_goal(goal, guidance)
        world = SimulatedWorld(
            self._scene, config.robot, config.camera, spec.start, spec.seed, config.world,
            is_instance_of,
        )  # fmt: skip
        return EpisodeSetup(
            world=world, mission=mission, planner_setup=planner_setup, planner=timed
        )

    def _search(self, setup: EpisodeSetup, spec: EpisodeSpec) -> SearchRecord:
        config = self._config
        reach = min(config.mission.map.ooi_max_range_m, config.robot.max_depth_m)
        return search(
            setup,
            self._judge(spec),
            config.limits,
            self._clocks.cpu,
            seen_within_m=reach,
            observer=self._witness,
        )

    def _row(
        self,
        row_id: str,
        spec: EpisodeSpec,
        method: Method,
        record: SearchRecord,
        began: tuple[float, float],
    ) -> EpisodeRow:
        config, last = self._config, record.last
        wall_s, cpu_s = self._clocks.wall() - began[0], self._clocks.cpu() - began[1]
        metrics = self._judge(spec).metrics(
            record.trajectory, stopped=record.ending == "found" and not record.wrong_instance
        )
        frame_s = config.limits.time_step_s * config.limits.steps_per_frame
        failure = failure_cause(
            success=metrics.success,
            ending=record.ending,
            seen=record.first_seen_s >= 0.0,
            recognised=record.recognised,
            stuck=record.ending == "time" and stood_still(record.positions, frame_s),
            touched=touched_there(record.positions, record.contacts, frame_s),
            wrong_instance=record.wrong_instance,
        )
        seen_spl, mapped_spl, reached_spl = _attainable(self._judge(spec), record)
        path = _thinned(record.trajectory[:, :2])
        planner_ms = 1e3 * np.array(record.planner_s or [0.0])
        return EpisodeRow(
            episode_id=row_id,
            method=method.name,
            home=spec.home,
            start_index=spec.start_index,
            start_x_m=spec.start.x,
            start_y_m=spec.start.y,
            start_yaw_rad=spec.start.yaw,
            goal=spec.goal,
            context=spec.context,
            colour=spec.colour,
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
            ending=record.ending,
            failure=failure,
            time_s=round(record.time_s, 3),
            frames=record.frames,
            hits=record.hits,
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
            realtime_factor=record.time_s / max(cpu_s, 1e-9),
            seen_spl=seen_spl,
            mapped_spl=mapped_spl,
            reached_spl=reached_spl,
            rule_steps=record.rule_steps,
            unruled_steps=record.unruled_steps,
        )


def _attainable(judge: Judge, record: SearchRecord) -> tuple[float, float, float]:
    """Return the SPL left at first view, at the first cluster and at the first place that counts.

    It is -1 for what never came.
    """
    path, mapped = record.trajectory, record.mapped_point
    reached = judge.first_success(path, mapped) if mapped >= 0 else -1
    points = (record.seen_point, mapped, reached)
    seen, cluster, place = (judge.attainable_spl(path, k) if k >= 0 else -1.0 for k in points)
    return seen, cluster, place


def _thinned(path: Float64Array, step_m: float = 0.1) -> Float64Array:
    """Return a point about every `step_m`, rounded to centimetres, with first and last point."""
    kept = [path[0]]
    for point in path[1:-1]:
        if float(np.linalg.norm(point - kept[-1])) >= step_m:
            kept.append(point)
    if len(path) > 1:
        kept.append(path[-1])
    return np.round(np.array(kept, dtype=np.float64), 2)
