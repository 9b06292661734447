"""A simulated home, robot and camera: commands in, frames out."""

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.frame import Frame
from ippon.geometry import Float64Array
from ippon.observation import Heatmap
from ippon.robot import RobotProfile
from ippon.segmentation.instance_heatmap import heatmap_of_instances
from ippon.simulation.camera.renderer import Rendering, SceneRenderer
from ippon.simulation.camera.sensor_noise import NoiseConfig, SensorNoise
from ippon.simulation.robot.goal_navigation import GoalNavigation
from ippon.simulation.robot.mobile_base import BaseConfig, SimulatedBase
from ippon.simulation.robot.odometry_drift import DriftConfig, OdometryDrift
from ippon.simulation.scene import Scene, StartPose
from ippon.simulation.segmentation.attribute_errors import (
    AttributeErrorConfig,
    AttributeErrors,
)
from ippon.simulation.segmentation.detector import DetectorConfig, SimulatedDetector
from ippon.simulation.segmentation.segmenter import SegmenterConfig, SimulatedSegmenter
from ippon.simulation.segmentation.truth import NamePredicate

SegmentationErrors = Literal["detector", "paper"]
"""`detector`: boxes with scores, with the measured errors of a real network. `paper`: label
probabilities of each pixel, with the errors that the paper describes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldConfig:
    """Configuration of the simulation apart from home, robot and camera."""

    base: BaseConfig = field(default_factory=BaseConfig)
    noise: NoiseConfig = field(default_factory=NoiseConfig)
    segmentation_errors: SegmentationErrors = "paper"
    """Which simulated network segments the images."""
    segmenter: SegmenterConfig = field(default_factory=SegmenterConfig)
    """Used with `paper`."""
    detector: DetectorConfig = field(default_factory=DetectorConfig)
    """Used with `detector`."""
    attribute_errors: AttributeErrorConfig = field(default_factory=AttributeErrorConfig)
    """How often an object of interest appears in another colour, for either network."""
    drift: DriftConfig = field(default_factory=DriftConfig)

    @classmethod
    def perfect(cls) -> "WorldConfig":
        """Return a world without errors of camera and segmentation."""
        return cls(noise=NoiseConfig.none(), segmenter=SegmenterConfig.perfect())


class SimulatedWorld:
    """Simulates a robot in a scene; equal seeds and commands give equal frames."""

    def __init__(
        self,
        scene: Scene,
        robot: RobotProfile,
        camera: PinholeCamera,
        start: StartPose,
        seed: int = 0,
        config: WorldConfig | None = None,
        is_instance_of: NamePredicate = operator.eq,
    ) -> None:
        self.scene = scene
        self.robot = robot
        self.camera = camera
        self.config = config or WorldConfig()
        self.base = SimulatedBase(scene, robot, start, self.config.base)
        self.navigation = GoalNavigation(scene, robot, start) if robot.follows_goals else None
        """Drives a robot that goals lead; walks as a person who carries the camera."""
        self.stamp_ns = 0
        """Simulated clock."""
        self.frames = 0
        """Frames observed so far."""
        self.rendering: Rendering | None = None
        """Noise-free images of the last frame, with the true instance of every pixel."""
        self._seed = seed
        self._is_instance_of = is_instance_of
        self._touched = False
        """The base was in contact since the last frame."""
        self._trajectory = [(start.x, start.y, start.z)]
        self._renderer = SceneRenderer(scene)
        self._noise = SensorNoise(
            camera, robot.min_depth_m, robot.max_depth_m, self.config.noise, seed
        )
        self._drift = OdometryDrift(self.base.T_world_base, self.config.drift, seed)
        self._segmenter: SimulatedSegmenter | SimulatedDetector | None = None
        self._attribute_errors: AttributeErrors | None = None

    @property
    def T_world_base_estimated(self) -> Float64Array:  # noqa: N802
        """Estimated pose of the base, (4, 4)."""
        return self._drift.T_world_base

    @property
    def trajectory(self) -> Float64Array:
        """(K, 3) true positions of the base, metres: the start, then one per step that moved it."""
        return np.array(self._trajectory, dtype=np.float64)

    @property
    def collisions(self) -> int:
        """Number of times that the base came into contact."""
        return self.base.collisions

    def set_labels(self, labels: Sequence[str], ooi: str | None, also: Sequence[str] = ()) -> None:
        """Set the labels of the segmentation from the next frame on; no labels turn it off.

        Args:
            labels: Canonical common labels.
            ooi: Canonical label of the object of interest.
            also: Canonical labels of further objects of interest.
        """
        also = tuple(name for name in dict.fromkeys(also) if name != ooi)
        if not labels:
            self._segmenter = None
            return
        old = self._segmenter
        if old is not None and (old.labels, old.ooi, old.also) == (tuple(labels), ooi, also):
            return
        wanted = also if ooi is None else (ooi, *also)
        if self.config.attribute_errors.rate > 0.0:
            self._attribute_errors = AttributeErrors(
                self.scene, wanted, self.config.attribute_errors, self._seed, self._is_instance_of
            )
        if self.config.segmentation_errors == "detector":
            self._segmenter = SimulatedDetector(
                self.scene,
                labels,
                ooi,
                self.config.detector,
                self._seed,
                self._is_instance_of,
                also=also,
            )
        else:
            self._segmenter = SimulatedSegmenter(
                self.scene,
                labels,
                ooi,
                self.config.segmenter,
                self._seed,
                self._is_instance_of,
                also=also,
            )

    def step(self, command: Command | None, dt_s: float) -> None:
        """Advance by `dt_s` seconds; `command` is a new command at their beginning, or None."""
        if self.navigation is not None and command is not None and self._by_itself(command):
            base = self.base
            pose = (base.x_m, base.y_m, base.yaw_rad)
            command = self.navigation.velocities(command.goal, pose, command.tilt_rad)
        self.base.step(command, dt_s)
        self._touched = self._touched or self.base.contact
        self.stamp_ns += round(dt_s * 1e9)
        position = (self.base.x_m, self.base.y_m, self.base.z_m)
        if position != self._trajectory[-1]:  # A standing robot does not fill the memory.
            self._trajectory.append(position)
        self._drift.follow(self.base.T_world_base)

    def _by_itself(self, command: Command) -> bool:
        return command.linear_m_s == command.yaw_rate_rad_s == 0.0

    def observe(self) -> Frame:
        """Return the frame at the current time, with a contact since the last one."""
        index = self.frames
        self.frames += 1
        rng = np.random.Generator(np.random.PCG64([self._seed, 0xF7A3E, index]))
        T_base_camera = self.robot.T_base_camera(self.base.tilt_rad)
        T_world_camera = self.base.T_world_base @ T_base_camera
        rendering = self.rendering = self._renderer.render(self.camera, T_world_camera)
        T_world_base = self._drift.T_world_base
        seen = rendering.color
        if self._attribute_errors is not None:
            seen = self._attribute_errors.apply(rendering, T_world_camera[:3, 3])
        touched, self._touched = self._touched or self.base.contact, False
        color = self._noise.corrupt_color(seen, rng)
        depth = self._noise.corrupt_depth(rendering.depth, rng)
        return Frame(
            stamp_ns=self.stamp_ns,
            color=color,
            depth=depth,
            camera=self.camera,
            T_world_camera=T_world_base @ T_base_camera,
            T_world_base=T_world_base,
            tilt_rad=self.base.tilt_rad,
            heatmap=self._segment(rendering, depth, T_world_camera, index),
            contact=touched,
        )

    def path_length_m(self) -> float:
        """Return the true length of the path driven, metres."""
        steps = np.diff(self.trajectory, axis=0)
        return math.fsum(np.linalg.norm(steps, axis=1))

    def _segment(
        self,
        rendering: Rendering,
        depth: NDArray[np.float32],
        T_world_camera: Float64Array,
        index: int,
    ) -> Heatmap | None:
        if self._segmenter is None:
            return None
        if isinstance(self._segmenter, SimulatedDetector):
            found = self._segmenter.detect(rendering, self.camera, T_world_camera, index)
            return heatmap_of_instances(found, depth)
        return self._segmenter.segment(rendering, T_world_camera[:3, 3], index)
