"""Begins, changes and ends searches on request of the operator."""

from collections.abc import Sequence
from typing import Final

from ippon.frame import Frame
from ippon.guidance.levels import Guidance
from ippon.mapping.goal_layers.goal_arrays import MAX_GOALS
from ippon.mapping.goal_layers.goal_layers import GoalLayers
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.look_around import LookAround
from ippon.mission.config import MissionConfig
from ippon.mission.finds.find_geometry import counted_text
from ippon.mission.finds.rejection import (
    count_find,
    count_known,
    exclude_only,
    reject_find,
    reject_known,
    update_candidates,
)
from ippon.mission.goal import Goal
from ippon.mission.journal import WAITING, Journal
from ippon.mission.search import Search
from ippon.mission.snapshot import OVER, Find, MissionState
from ippon.mission.tour import Tour, give_levels, target_of
from ippon.planning.interface import Planner
from ippon.planning.plan import Plan

_NO_GOAL: Final = "there is no such goal; set a goal first"


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
        self._search: Search | None = None
        self.tour: Tour | None = None
        """Several goals at once; None for one or none."""
        self._found_before: list[tuple[str, Find]] = []
        """Finds of earlier searches with their labels."""

    @property
    def search(self) -> Search | None:
        """The present search, or the one that ended last; of a tour the leading one."""
        return self._search if self.tour is None else self.tour.lead

    @property
    def running(self) -> tuple[Search, ...]:
        """The searches whose candidates are updated: of one goal also after its end."""
        if self.tour is not None:
            return self.tour.running
        return () if self._search is None else (self._search,)

    @property
    def asked(self) -> tuple[str, ...]:
        """Labels of the goals that the segmentation is asked for."""
        if self.tour is not None:
            return self.tour.asked
        return () if self._search is None else (self._search.goal.object,)

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
        self._remember_finds()
        known = goal.object in self._voxel_map.labels
        if not (known and self._look_around.was_done_for(goal.object, self.frame)):
            self._look_around.restart()
        self.tour = None
        search = self._search = Search(goal, guidance, self._config, self._voxel_map.models)
        self._planner.set_far_evidence(search.far_evidence)
        target = target_of(goal)
        self._voxel_map.set_ooi(
            target.label, target.highest_m, lowest_m=target.lowest_m, small_m=target.small_m
        )
        self._exclude_found_before(search)
        if self._look_around.done:
            search.state = MissionState.SEARCHING
        self._journal.why = f"starting the search for {goal.display}"
        give_levels(search, self._config, self._voxel_map, self._planner.set_goal)
        self._journal.note("goal_set", f"searching for {goal.display}")

    def set_goals(self, goals: Sequence[tuple[Goal, Guidance]]) -> None:
        """Search for several objects in one tour; map and roadmap stay, and the robot looks around.

        Args:
            goals: 2 to `MAX_GOALS` objects of different labels and numbers, each with the levels
                of the map's labels.

        Raises:
            ValueError: Another number of goals, two of one label or number, or levels that are not
                for the labels of this map, in their order.
        """
        for _, guidance in goals:
            self.check_guidance(guidance)
        numbers = [goal.goal_id for goal, _ in goals]
        if len(goals) < 2 or len(set(numbers)) != len(goals):
            raise ValueError(
                f"a tour takes 2 to {MAX_GOALS} goals of different numbers; got {numbers}"
            )
        self._remember_finds()
        layers = GoalLayers(self._voxel_map, [target_of(goal) for goal, _ in goals])
        models = self._voxel_map.models
        searches = [
            Search(goal, guidance, self._config, models, layers.layer(goal.object))
            for goal, guidance in goals
        ]
        for search in searches:
            self._exclude_found_before(search)
        self._search = None
        self.tour = Tour(searches, layers, self._planner, self._config.levels.as_array())
        self.tour.replan(begins=True)
        self._look_around.restart()
        if self._look_around.done:
            for search in searches:
                search.state = MissionState.SEARCHING
        names = " and ".join(goal.display for goal, _ in goals)
        self._journal.why = f"starting the search for {names}"
        self._journal.note("goal_set", f"searching for {names} in one tour")

    def _remember_finds(self) -> None:
        """Keep what the searches that end now found, rejected finds too, for who wants another."""
        for search in (self._search,) if self.tour is None else self.tour.searches:
            if search is not None:
                found = (*search.finds, *search.refused)
                self._found_before += [(search.goal.object, find) for find in found]

    def _exclude_found_before(self, search: Search) -> None:
        if search.goal.other:
            for label, find in self._found_before:
                if label == search.goal.object:
                    exclude_only(search, self._voxel_map, find)

    def observe(self, frame: Frame) -> None:
        """Add an image, which the map has fused, to the evidence of the searches."""
        for search in self.running:
            search.observe(frame)

    def advance(self, last: Frame | None, frame: Frame) -> None:
        """Add time and path since the last frame to the searches."""
        for search in self.running:
            search.advance(last, frame)

    def update_candidates(self, frame: Frame) -> None:
        """Find the candidates of the searches in the map."""
        for search in self.running:
            update_candidates(search, self._voxel_map, frame)

    def focus(self, plan: Plan) -> tuple[Search | None, tuple[Search, ...]]:
        """Return the search that a plan is for, and the others of a tour."""
        search = self._search if self.tour is None else self.tour.focus(plan)
        return search, tuple(one for one in self.running if one is not search)

    def settle(self, search: Search, state: MissionState) -> None:
        """Take over the state that a behavior gave a search.

        One of which more are wanted goes on behind its find; a tour goes on without the goals that
        were found in this step.
        """
        ended = state in OVER and search.state not in OVER
        search.state = state
        if ended and state is MissionState.FOUND and search.wants_more:
            self._count(search)
        if self.tour is not None:
            self.tour.settle()

    def _count(self, search: Search) -> None:
        count_find(search, self._voxel_map)
        search.state = MissionState.SEARCHING
        goal = search.goal
        text = counted_text(goal.display, len(search.counted), goal.count)
        self._journal.why = f"{text}: continuing the search"
        self._journal.note("counted", self._journal.why)
        if self.tour is None:
            self._planner.set_termination_min(search.termination_min)
        else:
            self.tour.replan()

    def count_again(
        self, goal_id: int, finds: Sequence[Find], rejected: Sequence[Find] = ()
    ) -> None:
        """Count what an earlier run of the search has found, which it then does not find again.

        Args:
            goal_id: Number of a goal that has just been set.
            finds: What counts.
            rejected: What the operator rejected: it is not found again either.

        Raises:
            ValueError: There is no such goal.
        """
        search = self._of(goal_id)
        if search is None:
            raise ValueError(_NO_GOAL)
        for find in rejected:
            reject_known(search, self._voxel_map, find)
        for find in finds:
            count_known(search, self._voxel_map, find)

    def set_guidance(self, guidance: Guidance, goal_id: int | None = None) -> None:
        """Replace the levels of a goal: by an answer, or by the operator's.

        Args:
            guidance: The levels.
            goal_id: Number of a goal of a tour; None for the present goal.

        Raises:
            ValueError: There is no such goal, or the guidance is not for the labels of this map,
                in their order.
        """
        self.check_guidance(guidance)
        search = self._of(goal_id)
        if search is None:
            raise ValueError(_NO_GOAL)
        search.guidance = guidance
        if self.tour is not None:
            self.tour.replan()
        else:
            give_levels(search, self._config, self._voxel_map, self._planner.set_levels)

    def cancel_goal(self, goal_id: int | None = None) -> None:
        """End the search without a result.

        Args:
            goal_id: Number of a goal of a tour, which continues without it; None for all goals.
                A number that no goal has changes nothing.
        """
        ended = self.running if goal_id is None else tuple(filter(None, (self._of(goal_id),)))
        for search in ended:
            if not search.over:
                display = search.goal.display
                self._journal.note("cancelled", f"the search for {display} was cancelled")
        if goal_id is not None and not ended:
            return
        if goal_id is not None and self.tour is not None:
            for search in ended:
                search.cancelled = True
                self.tour.dismiss(search)
            self.tour.settle()
            if not all(one.cancelled for one in self.tour.searches):
                return
        self._remember_finds()
        self._search = self.tour = None
        self._planner.set_far_evidence(None)
        self._planner.set_searching(False)
        self._journal.why = WAITING

    def reject_find(self, goal_id: int | None = None, number: int | None = None) -> bool:
        """Exclude a find, and continue the search for what is missing.

        Args:
            goal_id: Number of a goal of a tour; None for the find that was announced last.
            number: Number of a find of the goal, also of one that was counted; None for the one
                that ended the search.

        Returns:
            Whether there was a find to reject.
        """
        search = self._found(goal_id, number)
        if search is None:
            return False
        find = search.find_numbered(number)
        reject_find(search, self._voxel_map, self.frame, find)
        name = search.name_of(find)
        self._journal.note(
            "rejected", f"not the {name}: continuing the search", find and find.number
        )
        if search.over:
            search.state = MissionState.SEARCHING
        if self.tour is None:
            self._planner.set_termination_min(search.termination_min)
        else:
            self.tour.settle()
        self._journal.why = f"continuing the search for {search.goal.display}"
        return True

    def confirm_find(self, goal_id: int | None = None, number: int | None = None) -> bool:
        """Note that the operator confirms a find.

        Args:
            goal_id: Number of a goal of a tour; None for the find that was announced last.
            number: See `reject_find`.

        Returns:
            Whether there was a find to confirm.
        """
        search = self._found(goal_id, number)
        if search is None:
            return False
        find = search.find_numbered(number)
        if find is not None:
            search.confirm(find)
        if self.tour is not None and search.over and all(one.confirmed for one in search.finds):
            self.tour.dismiss(search)
        text = f"{search.name_of(find)}: confirmed by the operator"
        self._journal.note("confirmed", text, find and find.number)
        return True

    def _found(self, goal_id: int | None, number: int | None) -> Search | None:
        """Return the search with a find that waits to be judged; see `reject_find`."""
        search = self._of(goal_id)
        if self.tour is not None and goal_id is None:
            search = self.tour.announced
        if search is None or search.dismissed:
            return None
        if number is not None:
            return search if search.find_numbered(number) is not None else None
        is_settled = self.tour is not None and search.find is not None and search.find.confirmed
        return search if search.state is MissionState.FOUND and not is_settled else None

    def _of(self, goal_id: int | None) -> Search | None:
        """Return the search for a goal; None for the present one."""
        if self.tour is not None:
            return self.tour.of(goal_id)
        search = self._search
        same = search is not None and goal_id in (None, search.goal.goal_id)
        return search if same else None

    def check_guidance(self, guidance: Guidance) -> None:
        """Raise ValueError unless a guidance is for the labels of this map, in their order."""
        labels = tuple(row.label for row in guidance.rows)
        if labels != self._voxel_map.labels:
            raise ValueError(
                f"guidance speaks of {len(labels)} labels, the map of "
                f"{len(self._voxel_map.labels)}, or in another order"
            )
