"""Everything that decides how a search goes, from the map to the last look."""

from dataclasses import dataclass, field, replace

from ippon.control.follower import FollowerConfig
from ippon.guidance.levels import LevelProbabilities
from ippon.guidance.rooms import RoomConfig
from ippon.mapping.far_evidence.far_evidence import FarEvidenceConfig
from ippon.mapping.voxel_map import MapConfig
from ippon.mission.behaviors.floor_check import GlanceConfig
from ippon.mission.behaviors.look_around import LookAroundConfig
from ippon.mission.behaviors.recovery import RecoveryConfig
from ippon.mission.behaviors.travel_pitch import TravelPitchConfig
from ippon.mission.finds.image_check import SecondLookConfig
from ippon.planning.config import PlannerConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionConfig:
    """Everything that decides how a search goes."""

    map: MapConfig = field(default_factory=MapConfig)
    levels: LevelProbabilities = field(default_factory=LevelProbabilities)
    far_evidence: FarEvidenceConfig = field(default_factory=FarEvidenceConfig)
    rooms: RoomConfig = field(default_factory=RoomConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)
    follower: FollowerConfig = field(default_factory=FollowerConfig)
    look_around: LookAroundConfig = field(default_factory=LookAroundConfig)
    glance: GlanceConfig = field(default_factory=GlanceConfig)
    travel_pitch: TravelPitchConfig = field(default_factory=TravelPitchConfig)
    recovery: RecoveryConfig = field(default_factory=RecoveryConfig)
    second_look: SecondLookConfig = field(default_factory=SecondLookConfig)
    confirm_steps: int = 5
    """Frames that must agree in front of the object before it counts as found; more frames stop
    fewer searches at the wrong thing and take longer."""
    exhausted_steps: int = 15
    """Frames in a row without anything left to see before the search ends as exhausted."""

    def counted(self) -> "MissionConfig":
        """Return it without a budget in seconds: two runs of one seed are the same run."""
        return replace(self, planner=replace(self.planner, step_budget_s=None))
