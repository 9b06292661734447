"""Notices that nothing is left to explore: returns to what was doubted, or ends the search."""

from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.behavior import Action, Situation
from ippon.mission.config import MissionConfig
from ippon.mission.finds.find_geometry import exhausted_text
from ippon.mission.finds.rejection import readmit_most_likely
from ippon.mission.journal import Journal
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState
from ippon.planning.interface import Planner
from ippon.planning.plan import Plan


class Exhaustion:
    """Counts the steps in a row that promise nothing, and concludes from them."""

    def __init__(
        self, config: MissionConfig, voxel_map: VoxelMap, planner: Planner, journal: Journal
    ) -> None:
        self._config = config.exhaustion
        self._voxel_map = voxel_map
        self._planner = planner
        self._journal = journal

    def act(self, situation: Situation) -> Action | None:
        """See `Behavior.act`."""
        search, plan = situation.search, situation.plan
        if search is None:
            return None
        self._relax_termination(search, situation)
        self.count(search, plan)
        exhausted = search.empty_steps >= self._config.empty_steps
        idle = search.idle_steps >= self._config.idle_steps
        if (exhausted or idle) and readmit_most_likely(search, self._voxel_map):
            why = f"going back to what may be {search.goal.display} after all"
            self._journal.note("reconsidered", f"nothing better is left: {why}")
            return Action(situation.hold, MissionState.SEARCHING, why) if exhausted else None
        if not exhausted:
            return None
        why = exhausted_text(search.goal.display, search.candidates, full=plan.full)
        self._journal.note(MissionState.EXHAUSTED.value, why)
        return Action(situation.hold, MissionState.EXHAUSTED, why)

    def count(self, search: Search, plan: Plan) -> None:
        """Count a step that promises nothing; a plan that was cut short proves nothing."""
        if plan.exhausted:
            search.empty_steps += 1
        elif plan.target is not None or not plan.cut_short:
            search.empty_steps = 0
        if not self._is_idle(plan):
            search.idle_steps = 0
        elif not plan.cut_short:
            search.idle_steps += 1

    def _is_idle(self, plan: Plan) -> bool:
        """Return whether the best path to explore promises next to nothing."""
        if plan.ends_search or plan.closer_look:
            return False
        return plan.max_gain_per_s < self._config.idle_gain

    def _relax_termination(self, search: Search, situation: Situation) -> None:
        """Lower T_min once a small object is sure and no approach to it is left to try."""
        if search.relaxed_termination or situation.plan.ends_search or situation.plan.closer_look:
            return
        search.relaxed_termination = search.shows_single_voxel(situation.frame.T_world_base)
        if search.relaxed_termination:
            self._planner.set_termination_min(search.termination_min)
