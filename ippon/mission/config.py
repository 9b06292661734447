"""All parameters of a search."""

from dataclasses import dataclass, field, replace

from ippon.control.goal_follower import GoalFollowerConfig
from ippon.control.path_follower import FollowerConfig
from ippon.guidance.levels import LevelProbabilities
from ippon.mapping.far_evidence.far_evidence import FarEvidenceConfig
from ippon.mapping.voxel_map import MapConfig
from ippon.mission.behaviors.config import (
    ExhaustionConfig,
    FloorCheckConfig,
    LookAroundConfig,
    RecoveryConfig,
    StepCloserConfig,
    TravelPitchConfig,
)
from ippon.mission.finds.attributes.attribute_check import AttributeCheckConfig
from ippon.mission.finds.context_check import ContextCheckConfig
from ippon.mission.finds.find_geometry import ExclusionConfig
from ippon.mission.finds.image_check import ImageCheckConfig
from ippon.mission.finds.second_opinion import SecondOpinionConfig
from ippon.mission.finds.size_check import SizeCheckConfig
from ippon.planning.config import PlannerConfig
from ippon.rooms.said_rooms import SaidRoomConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionConfig:
    """All parameters of a search."""

    map: MapConfig = field(default_factory=MapConfig)
    levels: LevelProbabilities = field(default_factory=LevelProbabilities)
    far_evidence: FarEvidenceConfig = field(default_factory=FarEvidenceConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)
    follower: FollowerConfig = field(default_factory=FollowerConfig)
    goals: GoalFollowerConfig = field(default_factory=GoalFollowerConfig)
    """For robots that take goals in place of velocities."""
    look_around: LookAroundConfig = field(default_factory=LookAroundConfig)
    floor_check: FloorCheckConfig = field(default_factory=FloorCheckConfig)
    travel_pitch: TravelPitchConfig = field(default_factory=TravelPitchConfig)
    recovery: RecoveryConfig = field(default_factory=RecoveryConfig)
    step_closer: StepCloserConfig = field(default_factory=StepCloserConfig)
    exhaustion: ExhaustionConfig = field(default_factory=ExhaustionConfig)
    image_check: ImageCheckConfig = field(default_factory=ImageCheckConfig)
    size_check: SizeCheckConfig = field(default_factory=SizeCheckConfig)
    exclusion: ExclusionConfig = field(default_factory=ExclusionConfig)
    context_check: ContextCheckConfig = field(default_factory=ContextCheckConfig)
    second_opinion: SecondOpinionConfig = field(default_factory=SecondOpinionConfig)
    attribute_check: AttributeCheckConfig = field(default_factory=AttributeCheckConfig)
    said_rooms: SaidRoomConfig = field(default_factory=SaidRoomConfig)
    confirm_steps: int = 5
    """Frames in front of the object, less those without it, after which it is found; more ends
    fewer searches at the wrong object and takes longer."""

    def __post_init__(self) -> None:
        """Reject a find that no frame confirms."""
        if self.confirm_steps < 1:
            raise ValueError(f"confirm_steps must be at least 1; got {self.confirm_steps}")

    def counted(self) -> "MissionConfig":
        """Return the configuration without a time budget: two runs with one seed are identical."""
        return replace(self, planner=replace(self.planner, step_budget_s=None))
