"""Returns to a doubted find, or ends the search, once too little is left to explore."""

from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.behavior import Action, StepContext
from ippon.mission.config import MissionConfig
from ippon.mission.finds.rejection import readmit_most_likely
from ippon.mission.journal import Journal
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState
from ippon.mission.tour import least_termination_min
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
        self._relax_termination(step)
        for one in step.searches:
            self.count(one, plan, counts=step.counts)
        exhausted = search.empty_steps >= self._config.empty_steps
        idle = search.idle_steps >= self._config.idle_steps
        readmitted = self._readmit(step) if exhausted or idle else None
        if readmitted is not None:
            # The others of a tour have not ended either while the robot goes back.
            for one in step.searches:
                one.empty_steps = one.idle_steps = 0
            why = f"going back to what may be {readmitted.goal.display} after all"
            self._journal.note("reconsidered", f"nothing better is left: {why}")
            return Action(step.hold, MissionState.SEARCHING, why) if exhausted else None
        if not exhausted:
            return None
        for one in step.searches:
            one.end()
            text = one.ended_text(full=plan.full)
            self._journal.note(one.state.value, text, goal_id=one.goal.goal_id)
        return Action(step.hold, search.state, search.ended_text(full=plan.full))

    def _readmit(self, step: StepContext) -> Search | None:
        """Return the search whose most likely doubted candidate was readmitted, if there is one."""
        for one in step.searches:
            # What is doubtful is no better than nothing where all are wanted and some were found.
            enough = one.goal.count == "all" and bool(one.counted)
            if not enough and readmit_most_likely(one, self._voxel_map):
                return one
        return None

    def count(self, search: Search, plan: Plan, *, counts: bool = True) -> None:
        """Count a step with too little gain; one that was cut short does not count."""
        if plan.exhausted:
            search.empty_steps += counts
        elif plan.target is not None or not plan.cut_short:
            search.empty_steps = 0
        if not self._is_idle(plan):
            search.idle_steps = 0
        elif not plan.cut_short:
            search.idle_steps += counts

    def _is_idle(self, plan: Plan) -> bool:
        """Return whether the best exploring path has less gain per second than `idle_gain`."""
        if plan.ends_search or plan.closer_look:
            return False
        return plan.max_gain_per_s < self._config.idle_gain

    def _relax_termination(self, step: StepContext) -> None:
        """Lower T_min for a small object that is surely there, when no approach is planned."""
        if step.plan.ends_search or step.plan.closer_look:
            return
        for search in step.searches:
            if search.relaxed_termination:
                continue
            search.relaxed_termination = search.shows_single_voxel(step.frame.T_world_base)
            if search.relaxed_termination:
                self._planner.set_termination_min(least_termination_min(step.searches))
