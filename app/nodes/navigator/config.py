"""Configuration of the navigator."""

import math
from dataclasses import dataclass, field
from typing import Final

from app.messages.keys import check_prefix
from app.robot_file import DetectorTable
from ippon.mission.config import MissionConfig
from ippon.observation_model import ObservationModel
from ippon.robot import ZED, RobotProfile
from ippon.seed import check_seed
from ippon.vocabulary import MATTERPORT_40

LONGEST_STALE_S: Final = 10.0
"""Longest time for which a command may be repeated: the robot drives without new images."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigatorConfig:
    """Endpoint, robot and search of one navigator."""

    listen: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint that robot, console and requesters connect to."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    profile: RobotProfile = ZED
    detector: DetectorTable = field(default_factory=DetectorTable)
    """How to read the detections that the robot sends."""
    camera_clock_offset_s: float = 0.0
    """How far the camera's clock is behind that of the poses."""
    observation_model: ObservationModel | None = None
    """What the scores of the network are worth; None for the shipped default."""
    mission: MissionConfig = field(default_factory=MissionConfig)
    labels: tuple[str, ...] = MATTERPORT_40
    """Common objects that the segmentation has to recognise."""
    language_model: str = ""
    """Name of the language model that is asked for levels, as the operator sees it; empty for none.
    It is recorded with the configuration; its API key is not."""
    look_every_s: float = 0.0
    """Interval at which the language model is shown the camera image and may add common objects
    that it sees; 0 never shows it an image."""
    second_opinion: bool = False
    """Before a find is announced, the language model is shown it and asked."""
    seed: int = 0
    """Seed of the planner's samples."""
    command_hz: float = 30.0
    """Rate of the command stream, independent of the time that planning takes."""
    stale_s: float = 0.5
    """A command is repeated for at most this long, 10 s or less; teleoperation drives only while
    the last frame is younger."""
    lost_s: float = 1.0
    """Silence after which a required stream counts as lost."""
    heatmap_lost_s: float = 3.0
    """Silence after which the segmentation, slower than a camera, counts as lost."""
    keyframe_every_s: float = 10.0
    """Interval at which the whole map is published for recordings."""
    hold_find_s: float = 5.0
    """Time for which a find can be confirmed or rejected before the next queued goal starts; longer
    delays the queue."""
    max_queue: int = 20
    """Largest number of queued goals."""
    keep_map: str = ""
    """File that keeps map and goals between runs; empty keeps nothing."""
    resume: bool = False
    """Go on by itself with the goals of a run that was killed in mid-search."""
    keep_searches: str = ""
    """File of the saved searches; empty keeps them only while the process runs."""

    def __post_init__(self) -> None:
        """Refuse an invalid prefix or seed, and values without meaning."""
        check_prefix(self.robot)
        check_seed(self.seed)
        for name in ("command_hz", "lost_s", "heatmap_lost_s", "keyframe_every_s"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be finite and above 0; got {getattr(self, name)}")
        for name in ("hold_find_s", "look_every_s"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be finite and at least 0; got {getattr(self, name)}")
        if not 0.0 < self.stale_s <= LONGEST_STALE_S:
            raise ValueError(
                f"stale_s must be above 0 and at most {LONGEST_STALE_S:g}; got {self.stale_s}"
            )
        if not math.isfinite(self.camera_clock_offset_s):
            raise ValueError(
                f"camera_clock_offset_s must be finite; got {self.camera_clock_offset_s}"
            )
        if self.max_queue < 1:
            raise ValueError(f"max_queue must be at least 1; got {self.max_queue}")
        if not self.labels or not all(map(str.strip, self.labels)):
            raise ValueError("labels must name at least one object, and none may be empty")
        if len(set(self.labels)) < len(self.labels):
            raise ValueError("labels must differ; one is named twice")
