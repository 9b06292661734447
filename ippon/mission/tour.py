"""Several searches on one map with one plan: the goals of a tour."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.levels import Level
from ippon.mapping.far_evidence.joint_evidence import JointEvidence
from ippon.mapping.goal_layers.goal_layers import GoalLayers, OoiTarget
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.config import MissionConfig
from ippon.mission.finds.find_geometry import gap_m
from ippon.mission.finds.termination_threshold import lowest_m
from ippon.mission.goal import Goal
from ippon.mission.search import Search
from ippon.mission.snapshot import GoalState, GoalStatus, MissionState
from ippon.planning.interface import Planner
from ippon.planning.plan import Plan


class Tour:
    """The searches of a tour, of which one leads: behaviors act for it.

    The planner's gain is over all goals that are missing: the map's `ooi` is the highest of their
    probabilities, the level of a label the highest that one of them has, and far evidence the
    strongest. T_min is the smallest; a find of a larger object is judged by its own.

    Args:
        searches: One for each goal, each with its layer of `layers`.
        layers: The map's evidence for the goals.
        planner: Plans for all of them.
        probabilities: (4,) l(O | C) by level.
    """

    def __init__(
        self,
        searches: Sequence[Search],
        layers: GoalLayers,
        planner: Planner,
        probabilities: NDArray[np.float32],
    ) -> None:
        self.searches = tuple(searches)
        self.lead = self.searches[0]
        """The search that the present plan is for; the last one when all have ended."""
        self._layers = layers
        self._planner = planner
        self._probabilities = probabilities
        self._left: set[int] = set()
        self._announced: list[Search] = []
        """Searches that have ended with a find, the latest last."""

    @property
    def running(self) -> tuple[Search, ...]:
        """The searches that go on, in the order of the goals."""
        return tuple(search for search in self.searches if not search.over)

    @property
    def asked(self) -> tuple[str, ...]:
        """Labels that the segmentation is asked for."""
        return self._layers.asked

    @property
    def statuses(self) -> tuple[GoalStatus, ...]:
        """The goals with their states, in the order in which they were named."""
        return tuple(
            GoalStatus(
                goal=search.goal,
                state=_state_of(search),
                find=search.find,
                counted=tuple(search.counted),
                rejected=tuple(search.refused),
            )
            for search in self.searches
        )

    @property
    def announced(self) -> Search | None:
        """The search whose find was announced last and is neither confirmed nor rejected."""
        found = (s for s in reversed(self._announced) if _state_of(s) is GoalState.FOUND)
        return next(found, None)

    def of(self, goal_id: int | None) -> Search | None:
        """Return the search for a goal; None for a number that no goal has.

        Args:
            goal_id: Number of the goal; None for the leading search.
        """
        if goal_id is None:
            return self.lead
        return next((one for one in self.searches if one.goal.goal_id == goal_id), None)

    def focus(self, plan: Plan) -> Search:
        """Return the search that a plan is for, from now on the leading one.

        Args:
            plan: The plan of this step. If it leads to a candidate, the search of that candidate
                leads.
        """
        running = self.running
        if running and self.lead not in running:
            self.lead = running[0]
        target = plan.target
        if target is not None and (plan.ends_search or plan.closer_look):
            end = target.position_world[:2]
            self.lead = min(running, key=lambda one: _distance_m(one, end), default=self.lead)
        return self.lead

    def settle(self) -> None:
        """Take searches that have ended out of the plan, and return those that continue to it."""
        left = {n for n, search in enumerate(self.searches) if search.over}
        changed = left != self._left
        for column in sorted(left ^ self._left):
            search = self.searches[column]
            if not search.dismissed:
                self._layers.set_missing(column, missing=column not in left)
            if search.state is MissionState.FOUND:
                self._announced.append(search)
        self._left = left
        if changed and self.running:
            # As before another search, what was opened before that one ended is closed.
            self._planner.set_searching(False)
            self.replan()
        if self.lead.over and self.running:
            self.lead = self.running[0]
            if self.lead.state is MissionState.STARTING:
                self.lead.state = MissionState.SEARCHING
        elif self.lead.cancelled:
            kept = (one for one in self.searches if not one.cancelled)
            self.lead = next(kept, self.lead)

    def dismiss(self, search: Search) -> None:
        """Stop updating the map for a goal that was cancelled or confirmed."""
        search.dismissed = True
        self._layers.end(self.searches.index(search))

    def levels(self) -> NDArray[np.uint8]:
        """Return (N,) the highest level of each label for any missing goal."""
        return np.maximum.reduce([one.guidance.levels() for one in self.running or self.searches])

    def replan(self, *, begins: bool = False) -> None:
        """Give map and planner the levels, the thresholds and the far evidence of what is left.

        Args:
            begins: The planner forgets what it looked at for the goals before.
        """
        searches = self.running or self.searches
        for search in searches:
            search.far_evidence.set_cues(search.guidance.labels_of(Level.CERTAIN))
        self._planner.set_far_evidence(JointEvidence([one.far_evidence for one in searches]))
        self._layers.set_levels(self.levels(), self._probabilities)
        set_planner = self._planner.set_goal if begins else self._planner.set_levels
        set_planner(
            probabilities=self._probabilities, termination_min=least_termination_min(searches)
        )


def give_levels(
    search: Search, config: MissionConfig, voxel_map: VoxelMap, set_planner: Callable[..., None]
) -> None:
    """Give map and planner the levels of a goal that is searched for alone.

    Args:
        search: The search.
        config: Probabilities of the levels.
        voxel_map: The map.
        set_planner: `Planner.set_goal` or `Planner.set_levels`.
    """
    search.far_evidence.set_cues(search.guidance.labels_of(Level.CERTAIN))
    probabilities = config.levels.as_array()
    voxel_map.set_levels(search.guidance.levels(), probabilities)
    set_planner(probabilities=probabilities, termination_min=search.termination_min)


def least_termination_min(searches: Sequence[Search]) -> float:
    """Return the smallest T_min of some searches, at least one."""
    return min(search.termination_min for search in searches)


def target_of(goal: Goal) -> OoiTarget:
    """Return what the map must know of a goal."""
    knowledge = load_knowledge()
    # An air conditioner hangs higher than the appliances that it is one of.
    known = knowledge.thing(goal.object) is not None
    hangs = known and math.isinf(knowledge.highest_m(goal.object))
    return OoiTarget(
        label=goal.object,
        highest_m=math.inf if hangs else knowledge.highest_m(goal.category or goal.object),
        lowest_m=lowest_m(goal.object, goal.category),
        small_m=knowledge.small_m(goal.object),
    )


def _distance_m(search: Search, xy: tuple[float, float]) -> float:
    """Return how far the nearest candidate of a search begins from a point, infinite without."""
    at = np.array(xy)
    return min((gap_m(at, find) for find in search.candidates), default=math.inf)


def _state_of(search: Search) -> GoalState:
    if search.cancelled:
        return GoalState.CANCELLED
    if search.state is MissionState.FOUND:
        confirmed = search.dismissed or (search.find is not None and search.find.confirmed)
        return GoalState.CONFIRMED if confirmed else GoalState.FOUND
    return GoalState.NOT_FOUND if search.state is MissionState.EXHAUSTED else GoalState.MISSING
