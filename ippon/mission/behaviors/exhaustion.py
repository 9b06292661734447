"""Returns to a doubted find, or ends the search, once too little is left to explore."""

from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.behavior import Action, StepContext
from ippon.mission.config import MissionConfig
from ippon.mission.finds.find_geometry import exhausted_text
from ippon.mission.finds.rejection import readmit_most_likely
from ippon.mission.journal import Journal
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState
from ippon.planning.interface import Planner
from ippon.planning.plan import Plan


class Exhaustion:
    """Counts the steps in a row in which the plan has too little gain."""

    def __init__(
        self, config: MissionConfig, voxel_map: VoxelMap, planner: Planner, journal: Journal
    ) -> None:
        self._config = config.exhaustion
        self._voxel_map = voxel_map
        self._planner = planner
        self._journal = journal

    def act(self, step: StepContext) -> Action | None:
        """See `Behavior.act`."""
        search, plan = step.search, step.plan
        if search is None:
            return None
        self._relax_termination(search, step)
        self.count(search, plan)
        exhausted = search.empty_steps >= self._config.empty_steps
        idle = search.idle_steps >= self._config.idle_steps
        if (exhausted or idle) and readmit_most_likely(search, self._voxel_map):
            why = f"going back to what may be {search.goal.display} after all"
            self._journal.note("reconsidered", f"nothing better is left: {why}")
            return Action(step.hold, MissionState.SEARCHING, why) if exhausted else None
        if not exhausted:
            return None
        why = exhausted_text(search.goal.display, search.candidates, full=plan.full)
        self._journal.note(MissionState.EXHAUSTED.value, why)
        return Action(step.hold, MissionState.EXHAUSTED, why)

    def count(self, search: Search, plan: Plan) -> None:
        """Count a step with too little gain; one that was cut short does not count."""
        if plan.exhausted:
            search.empty_steps += 1
        elif plan.target is not None or not plan.cut_short:
            search.empty_steps = 0
        if not self._is_idle(plan):
            search.idle_steps = 0
        elif not plan.cut_short:
            search.idle_steps += 1

    def _is_idle(self, plan: Plan) -> bool:
        """Return whether the best exploring path has less gain per second than `idle_gain`."""
        if plan.ends_search or plan.closer_look:
            return False
        return plan.max_gain_per_s < self._config.idle_gain

    def _relax_termination(self, search: Search, step: StepContext) -> None:
        """Lower T_min for a small object that is surely there, when no approach is planned."""
        if search.relaxed_termination or step.plan.ends_search or step.plan.closer_look:
            return
        search.relaxed_termination = search.shows_single_voxel(step.frame.T_world_base)
        if search.relaxed_termination:
            self._planner.set_termination_min(search.termination_min)
