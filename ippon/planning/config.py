"""Everything that decides where the robot looks next."""

import math
from dataclasses import dataclass, field

from ippon.planning.roadmap.connection import ConnectionConfig
from ippon.planning.roadmap.local_planner import LocalPlannerConfig
from ippon.planning.roadmap.sampling import SamplingConfig
from ippon.planning.selection.approach import CloserLookConfig
from ippon.planning.selection.node_selection import SelectionConfig
from ippon.planning.terrain.traversability import TraversabilityConfig
from ippon.planning.terrain.unseen_gaps import UnseenGapConfig
from ippon.planning.visibility.viewpoints import ViewConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerConfig:
    """Everything that decides where the robot looks next."""

    ooi_threshold: float = 0.8
    """p_T: posterior above which a voxel is one of the object; more stops later and errs less."""
    view: ViewConfig = field(default_factory=ViewConfig)
    sampling: SamplingConfig = field(default_factory=SamplingConfig)
    traversability: TraversabilityConfig = field(default_factory=TraversabilityConfig)
    unseen_gap: UnseenGapConfig = field(default_factory=UnseenGapConfig)
    connection: ConnectionConfig = field(default_factory=ConnectionConfig)
    local_planner: LocalPlannerConfig = field(default_factory=LocalPlannerConfig)
    selection: SelectionConfig = field(default_factory=SelectionConfig)
    closer_look: CloserLookConfig = field(default_factory=CloserLookConfig)
    samples_per_step: int = 10
    """Viewpoints added in a step at most; more covers new space sooner."""
    evaluations_per_step: int = 4
    """Viewpoints evaluated in a step at most, about 1 ms each; a step with six chose no better."""
    second_chances: int = 2
    """Times a search that would end opens again what contacts closed and tries gaps that are all
    but too narrow; more tries harder and takes longer to give up."""
    step_budget_s: float | None = None
    """Seconds after which a step begins nothing new and returns the best plan so far; fewer answer
    sooner and choose among less. None counts the work alone: two runs of one seed are the same."""
    max_nodes: int = 4000
    """Viewpoints kept at most; 1,000 m² of floor takes about 1,500. With no room left those go that
    lie as densely as near the robot where it no longer is; more than that are not added."""

    def __post_init__(self) -> None:
        """Reject budgets that never get anywhere."""
        if not 0.0 < self.ooi_threshold < 1.0:
            raise ValueError(f"ooi_threshold must lie in (0, 1); got {self.ooi_threshold}")
        if self.samples_per_step < 1 or self.evaluations_per_step < 2 or self.max_nodes < 10:
            raise ValueError(
                "samples_per_step must be at least 1, evaluations_per_step 2, max_nodes 10; got "
                f"{self.samples_per_step}, {self.evaluations_per_step}, {self.max_nodes}"
            )
        if self.step_budget_s is not None and not 0.0 < self.step_budget_s < math.inf:
            raise ValueError(
                "step_budget_s must be finite and above 0, or None to count the work alone; got "
                f"{self.step_budget_s}"
            )
