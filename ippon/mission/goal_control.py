"""Begins, changes and ends searches on request of the operator."""

from typing import Final

from ippon.frame import Frame
from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.levels import Guidance, Level
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.look_around import LookAround
from ippon.mission.config import MissionConfig
from ippon.mission.finds.rejection import reject_find
from ippon.mission.finds.termination_threshold import lowest_m
from ippon.mission.goal import Goal
from ippon.mission.journal import WAITING, Journal
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState
from ippon.planning.interface import Planner

_NO_GOAL: Final = "levels belong to a goal, and there is none; set a goal first"


class GoalControl:
    """Owns the present search."""

    def __init__(
        self,
        config: MissionConfig,
        voxel_map: VoxelMap,
        planner: Planner,
        look_around: LookAround,
        journal: Journal,
    ) -> None:
        self._config = config
        self._voxel_map = voxel_map
        self._planner = planner
        self._look_around = look_around
        self._journal = journal
        self.frame: Frame | None = None
        """The last frame that the mission decided on."""
        self.search: Search | None = None
        """The present search, or the one that ended last."""

    def set_goal(self, goal: Goal, guidance: Guidance) -> None:
        """Search for another object; map and roadmap stay.

        The robot looks around again, unless it did so here for an object of the map's labels.

        Args:
            goal: The object.
            guidance: Levels of the map's labels for it.

        Raises:
            ValueError: The guidance is not for the labels of this map, in their order.
        """
        self.check_guidance(guidance)
        known = goal.object in self._voxel_map.labels
        if not (known and self._look_around.was_done_for(goal.object, self.frame)):
            self._look_around.restart()
        models = self._voxel_map.models
        search = self.search = Search(goal, guidance, self._config, models)
        self._planner.set_far_evidence(search.far_evidence)
        knowledge = load_knowledge()
        self._voxel_map.set_ooi(
            goal.object,
            knowledge.highest_m(goal.category or goal.object),
            lowest_m=lowest_m(goal.object, goal.category),
            small_m=knowledge.small_m(goal.object),
        )
        if self._look_around.done:
            search.state = MissionState.SEARCHING
        self._journal.why = f"starting the search for {goal.display}"
        self.set_guidance(guidance)
        self._journal.note("goal_set", f"searching for {goal.display}")

    def set_guidance(self, guidance: Guidance) -> None:
        """Replace the levels of the present goal: by an answer, or by the operator's.

        Raises:
            ValueError: There is no goal, or the guidance is not for the labels of this map, in
                their order.
        """
        self.check_guidance(guidance)
        search = self.search
        if search is None:
            raise ValueError(_NO_GOAL)
        search.guidance = guidance
        search.far_evidence.set_cues(guidance.labels_of(Level.CERTAIN))
        probabilities = self._config.levels.as_array()
        self._voxel_map.set_levels(guidance.levels(), probabilities)
        self._planner.set_goal(probabilities=probabilities, termination_min=search.termination_min)

    def cancel_goal(self) -> None:
        """End the search without a result."""
        if self.search is not None and not self.search.over:
            display = self.search.goal.display
            self._journal.note("cancelled", f"the search for {display} was cancelled")
        self.search = None
        self._planner.set_far_evidence(None)
        self._journal.why = WAITING

    def reject_find(self) -> bool:
        """Exclude the find that ended the search, and continue the search.

        Returns:
            Whether there was a find to reject.
        """
        search = self.search
        if search is None or search.state is not MissionState.FOUND:
            return False
        reject_find(search, self._voxel_map, self.frame)
        self._planner.set_termination_min(search.termination_min)
        self._journal.note("rejected", f"not the {search.goal.display}: searching on")
        search.state = MissionState.SEARCHING
        self._journal.why = f"searching on for {search.goal.display}"
        return True

    def confirm_find(self) -> bool:
        """Note that the operator confirms the find.

        Returns:
            Whether there was a find to confirm.
        """
        search = self.search
        if search is None or search.state is not MissionState.FOUND:
            return False
        self._journal.note("confirmed", f"{search.goal.display}: confirmed by the operator")
        return True

    def check_guidance(self, guidance: Guidance) -> None:
        """Raise ValueError unless a guidance is for the labels of this map, in their order."""
        labels = tuple(row.label for row in guidance.rows)
        if labels != self._voxel_map.labels:
            raise ValueError(
                f"guidance speaks of {len(labels)} labels, the map of "
                f"{len(self._voxel_map.labels)}, or in another order"
            )
