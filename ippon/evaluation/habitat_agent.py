"""The search as an agent of habitat-lab: observations in, velocity actions out.

The numbers are those of the Habitat ObjectNav Challenge 2023. An agent of habitat-lab is anything
with `reset` and `act`, so that habitat-lab itself is not needed here.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.frame import Frame
from ippon.geometry import base_pose
from ippon.guidance.language.naming import ResolvedObject, resolve_object
from ippon.guidance.levels import Guidance
from ippon.mission.config import MissionConfig
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.mission.snapshot import MissionState
from ippon.observation import Heatmap
from ippon.robot import HABITAT, RobotProfile
from ippon.segmentation.instance_heatmap import as_heatmap
from ippon.segmentation.segmenter import Segmenter
from ippon.vocabulary import MATTERPORT_40, in_words

HM3D_GOALS: Final = ("chair", "bed", "plant", "toilet", "tv", "sofa")
"""Goals by the number of the `objectgoal` sensor in HM3D ObjectNav v2."""
TIME_STEP_S: Final = 0.1
_OVER: Final = (MissionState.FOUND, MissionState.EXHAUSTED)
_BLOCKED_SHARE: Final = 0.25
"""Share of the commanded distance below which the base counts as blocked."""
_LEAST_STEP_M: Final = 0.01

Action = dict[str, Any]
Guide = Callable[[ResolvedObject, tuple[str, ...]], Guidance]
"""Rates the common labels for a goal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HabitatAgentConfig:
    """Configuration of the agent."""

    robot: RobotProfile = HABITAT
    mission: MissionConfig = field(default_factory=MissionConfig)
    labels: tuple[str, ...] = MATTERPORT_40
    goals: tuple[str, ...] = HM3D_GOALS
    """Goal for each number of the `objectgoal` sensor."""
    image_stride: int = 2
    """Pixel stride of depth and colour for the map; more is faster and coarser. The segmenter gets
    all pixels."""
    steps_per_frame: int = 2
    """Actions between images; more is faster and reacts later."""
    seed: int = 0

    def __post_init__(self) -> None:
        """Reject values out of range."""
        if self.image_stride < 1 or self.steps_per_frame < 1 or not self.goals:
            raise ValueError(
                "image_stride and steps_per_frame are at least 1 and goals not empty; got "
                f"{self.image_stride}, {self.steps_per_frame}, {self.goals}"
            )


class IpponAgent:
    """Agent of habitat-lab that searches one episode after another."""

    def __init__(
        self, segmenter: Segmenter, guide: Guide, config: HabitatAgentConfig | None = None
    ) -> None:
        """Store segmenter, guidance and configuration.

        Args:
            segmenter: Segments the colour images at full size.
            guide: Returns the levels for a goal.
            config: Robot and mission.
        """
        self._segmenter = segmenter
        self._guide = guide
        self._config = config or HabitatAgentConfig()
        self.reset()

    @property
    def state(self) -> MissionState | None:
        """State of the mission, None before the first observation."""
        return None if self._mission is None else self._mission.state

    def reset(self) -> None:
        """Reset for the next episode."""
        self._mission: Mission | None = None
        self._ooi = ""
        self._steps = 0
        self._command = Command()
        self._tilt_rad = 0.0
        self._last_gps: NDArray[np.float64] | None = None
        self._contact = False

    def act(self, observations: Mapping[str, Any]) -> Action:
        """Return the action for one observation.

        Args:
            observations: `rgb` (H, W, 3) uint8; `depth` (H, W, 1) float32, 0 to 1 for the camera's
                nearest to farthest; `gps` (2,) metres forward and right of the start; `compass`
                (1,) radians, counter-clockwise from the start; `objectgoal` (1,) the goal's number.

        Returns:
            An action for `velocity_control` and `velocity_stop`, its velocities in -1 to 1.

        Raises:
            ValueError: A sensor is missing, or the goal's number is unknown.
        """
        missing = {"rgb", "depth", "gps", "compass", "objectgoal"} - set(observations)
        if missing:
            raise ValueError(
                f"the agent needs the sensors {', '.join(sorted(missing))}; it got "
                f"{', '.join(sorted(observations)) or 'none'}"
            )
        if self._mission is None:
            self._mission = self._begin(int(np.ravel(observations["objectgoal"])[0]))
        gps = np.ravel(observations["gps"]).astype(np.float64)
        self._watch(gps)
        stop = False
        if self._steps % self._config.steps_per_frame == 0:
            result = self._mission.step(self._frame(observations, gps))
            self._command = result.command
            stop = result.snapshot.state in _OVER
        self._steps += 1
        self._last_gps = gps
        return self._action(stop=stop)

    def _begin(self, number: int) -> Mission:
        config = self._config
        if not 0 <= number < len(config.goals):
            raise ValueError(
                f"objectgoal {number} is unknown; there are 0 to {len(config.goals) - 1}: "
                f"{', '.join(config.goals)}"
            )
        resolved = resolve_object(in_words(config.goals[number]), config.labels)
        mission = Mission(config.mission, config.robot, config.labels, config.seed)
        mission.goals.set_goal(Goal.of(resolved, 1), self._guide(resolved, config.labels))
        self._ooi = resolved.canonical
        return mission

    def _watch(self, gps: NDArray[np.float64]) -> None:
        """Detect contact from the distance moved, because there is no bumper."""
        told_m = self._command.linear_m_s * TIME_STEP_S
        if self._last_gps is None or told_m < _LEAST_STEP_M:
            return
        moved_m = float(np.linalg.norm(gps - self._last_gps))
        self._contact = self._contact or moved_m < _BLOCKED_SHARE * told_m

    def _frame(self, observations: Mapping[str, Any], gps: NDArray[np.float64]) -> Frame:
        config, robot = self._config, self._config.robot
        color = np.ascontiguousarray(observations["rgb"][..., :3], dtype=np.uint8)
        share = np.asarray(observations["depth"], np.float32).reshape(color.shape[:2])
        depth = robot.min_depth_m + share * (robot.max_depth_m - robot.min_depth_m)
        # Clipped readings only bound the distance.
        depth[(share <= 0.0) | (share >= 1.0)] = 0.0
        camera, color_small, depth_small = _thinned(color, depth, robot, config.image_stride)
        yaw = float(np.ravel(observations["compass"])[0])
        T_world_base = base_pose(float(gps[0]), -float(gps[1]), 0.0, yaw)
        contact, self._contact = self._contact, False
        return Frame(
            stamp_ns=round(self._steps * TIME_STEP_S * 1e9),
            color=color_small,
            depth=depth_small,
            camera=camera,
            T_world_camera=T_world_base @ robot.T_base_camera(self._tilt_rad),
            T_world_base=T_world_base,
            tilt_rad=self._tilt_rad,
            heatmap=self._segment(color, depth),
            contact=contact,
        )

    def _segment(self, color: NDArray[np.uint8], depth: NDArray[np.float32]) -> Heatmap:
        seen = self._segmenter.segment(color, self._config.labels, self._ooi)
        return as_heatmap(seen, depth)

    def _action(self, *, stop: bool) -> Action:
        """Scale the command to -1 to 1 and integrate the tilt, which no sensor reports."""
        robot, command = self._config.robot, self._command
        forward = min(max(command.linear_m_s / robot.max_linear_m_s, 0.0), 1.0)
        turn = min(max(command.yaw_rate_rad_s / robot.max_yaw_rate_rad_s, -1.0), 1.0)
        wanted = robot.within_tilt(command.tilt_rad)
        rate = (wanted - self._tilt_rad) / TIME_STEP_S / robot.max_tilt_rate_rad_s
        rate = 0.0 if stop else min(max(rate, -1.0), 1.0)
        self._tilt_rad += rate * robot.max_tilt_rate_rad_s * TIME_STEP_S
        pitch = np.array([rate], np.float32)
        return {
            "action": ("velocity_control", "velocity_stop"),
            "action_args": {
                "linear_velocity": np.array([2.0 * forward - 1.0], np.float32),
                "angular_velocity": np.array([turn], np.float32),
                # The challenge documents the first name, but reads the second.
                "camera_pitch_velocity": pitch,
                "camera_pitch_angular_velocity": pitch,
                "velocity_stop": np.array([1.0 if stop else -1.0], np.float32),
            },
        }


def _thinned(
    color: NDArray[np.uint8], depth: NDArray[np.float32], robot: RobotProfile, stride: int
) -> tuple[PinholeCamera, NDArray[np.uint8], NDArray[np.float32]]:
    """Return every `stride`-th pixel and the camera of the reduced images."""
    height, width = depth.shape
    first = stride // 2
    small = np.ascontiguousarray(depth[first::stride, first::stride])
    focal = 0.5 * width / math.tan(0.5 * robot.horizontal_fov_rad)
    camera = PinholeCamera(
        width=small.shape[1],
        height=small.shape[0],
        fx=focal / stride,
        fy=focal / stride,
        cx=(0.5 * (width - 1) - first) / stride,
        cy=(0.5 * (height - 1) - first) / stride,
    )
    return camera, np.ascontiguousarray(color[first::stride, first::stride]), small
