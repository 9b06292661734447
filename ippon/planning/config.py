"""Parameters of the planner."""

import math
from dataclasses import dataclass, field

from ippon.planning.roadmap.connection import ConnectionConfig
from ippon.planning.roadmap.local_planner import LocalPlannerConfig
from ippon.planning.roadmap.narrow_passages import NarrowPassageConfig
from ippon.planning.roadmap.sampling import SamplingConfig
from ippon.planning.selection.closer_look import CloserLookConfig
from ippon.planning.selection.node_selection import SelectionConfig
from ippon.planning.terrain.traversability import TraversabilityConfig
from ippon.planning.terrain.unseen_gaps import UnseenGapConfig
from ippon.planning.visibility.evaluation_scheduler import ViewpointEvaluationConfig
from ippon.planning.visibility.view_config import ViewConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerConfig:
    """Parameters of the planner and of its parts."""

    ooi_threshold: float = 0.8
    """p_T: posterior above which a voxel belongs to the object; more stops later and errs less."""
    view: ViewConfig = field(default_factory=ViewConfig)
    evaluation: ViewpointEvaluationConfig = field(default_factory=ViewpointEvaluationConfig)
    sampling: SamplingConfig = field(default_factory=SamplingConfig)
    traversability: TraversabilityConfig = field(default_factory=TraversabilityConfig)
    unseen_gap: UnseenGapConfig = field(default_factory=UnseenGapConfig)
    narrow_passages: NarrowPassageConfig = field(default_factory=NarrowPassageConfig)
    connection: ConnectionConfig = field(default_factory=ConnectionConfig)
    local_planner: LocalPlannerConfig = field(default_factory=LocalPlannerConfig)
    selection: SelectionConfig = field(default_factory=SelectionConfig)
    closer_look: CloserLookConfig = field(default_factory=CloserLookConfig)
    samples_per_step: int = 10
    """Viewpoints added in a step at most; more covers new space sooner."""
    max_object_voxels: int = 512
    """Object voxels, those nearest to the robot, that decide where viewpoints are added and what is
    worth a closer look; more takes longer and considers more objects at once."""
    second_chances: int = 2
    """Times that a search which would end reopens the cells of contacts and accepts narrower gaps;
    more tries more and takes longer to give up."""
    step_budget_s: float | None = None
    """Seconds after which a step begins no further work and returns the best plan so far; fewer
    answer sooner and choose among less. None bounds the work by counts alone, so that two runs with
    one seed are identical."""
    growth_share: float = 0.6
    """Fraction of `step_budget_s` for adding and connecting viewpoints; more leaves less time for
    evaluating them."""
    max_nodes: int = 4000
    """Viewpoints kept at most; 1,000 m² of floor takes about 1,500. A full roadmap is thinned out
    away from the robot, and takes no further viewpoint where that does not suffice."""
    reserved_nodes: int = 64
    """Nodes of those kept for viewpoints near an object and at the robot, at most an eighth of all;
    more covers less floor."""

    def __post_init__(self) -> None:
        """Reject budgets that never get anywhere."""
        if not 0.0 < self.ooi_threshold < 1.0:
            raise ValueError(f"ooi_threshold must lie in (0, 1); got {self.ooi_threshold}")
        if self.samples_per_step < 1 or self.max_object_voxels < 1 or self.max_nodes < 10:
            raise ValueError(
                "samples_per_step and max_object_voxels must be at least 1, max_nodes 10; got "
                f"{self.samples_per_step}, {self.max_object_voxels}, {self.max_nodes}"
            )
        if not 0.0 < self.growth_share <= 1.0 or self.reserved_nodes < 0:
            raise ValueError(
                "growth_share must lie in (0, 1] and reserved_nodes be at least 0; got "
                f"{self.growth_share}, {self.reserved_nodes}"
            )
        if self.step_budget_s is not None and not 0.0 < self.step_budget_s < math.inf:
            raise ValueError(
                "step_budget_s must be finite and above 0, or None to bound it by counts; got "
                f"{self.step_budget_s}"
            )
