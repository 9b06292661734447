"""Decides at a terminating viewpoint whether the candidate is the object (Sec. Node Selection)."""

from dataclasses import replace
from typing import NamedTuple

from ippon.command import COMMAND_S, Command
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.behavior import Action, StepContext
from ippon.mission.behaviors.step_closer import StepCloser
from ippon.mission.config import MissionConfig
from ippon.mission.finds.attributes.attribute_check import by_model, contradiction
from ippon.mission.finds.context_check import contradicts_context
from ippon.mission.finds.find_geometry import (
    ARRIVED_M,
    at_heights,
    find_from,
    gap_m,
    nearest_find,
    reached_find,
    same_find,
)
from ippon.mission.finds.rejection import exclude_only, set_aside
from ippon.mission.finds.second_opinion import SecondOpinions
from ippon.mission.journal import Journal
from ippon.mission.places.room_regions import RoomRegions
from ippon.mission.search import Search
from ippon.mission.snapshot import Find, MissionState
from ippon.vocabulary import in_words


class _Verified(NamedTuple):
    """A find that ends a search once the robot is close enough."""

    goal_id: int
    find: Find
    sentence: str | None
    """What the model said of it."""


class _Wait(NamedTuple):
    """For more images of a find that is not sure."""

    goal_id: int
    waited_s: float
    images: int
    """Images that were compared with candidates by the last step."""


class Confirmation:
    """Ends the search at a terminating viewpoint unless the evidence contradicts the find."""

    def __init__(
        self,
        config: MissionConfig,
        voxel_map: VoxelMap,
        journal: Journal,
        opinions: SecondOpinions,
        rooms: RoomRegions,
        closer: StepCloser,
    ) -> None:
        self._confirm_steps = config.confirm_steps
        self._context = config.context_check
        self._min_images = config.image_check.min_images
        self._most_wait_s = config.image_check.wait_s
        self._same_m = config.image_check.same_m
        self._find_from = config.planner.ooi_threshold
        self._view = config.planner.view
        self._opinions = opinions
        self._rooms = rooms
        self._voxel_map = voxel_map
        self._journal = journal
        self._closer = closer
        self._verified: _Verified | None = None
        self._wait: _Wait | None = None

    def act(self, step: StepContext) -> Action | None:
        """See `Behavior.act`."""
        search, plan = step.search, step.plan
        if search is None:
            return None
        ended = self._end_closer(step, search)
        if ended is not None:
            return ended
        still = Command(tilt_rad=step.follow_plan().tilt_rad)
        arrived = plan.ends_search and step.follower.reached
        # Frames without the object reduce the count as fast as others raise it.
        search.arrived_steps = max(0, search.arrived_steps + (1 if arrived else -1))
        elsewhere = plan.ends_search and not arrived
        if search.arrived_steps < self._confirm_steps:
            self._wait = None
        if elsewhere or search.arrived_steps < self._confirm_steps:
            return None
        find = self._find_here(step, search)
        if find is None:
            # The voxels that led here have disappeared.
            search.arrived_steps, self._wait = 0, None
            return None
        return self._judge(step, search, find, still)

    def _judge(self, step: StepContext, search: Search, find: Find, still: Command) -> Action:
        """Conclude with a find, wait for more images of it, or set it aside."""
        display = search.goal.display
        objection = self._objection(search, find)
        unsure = objection is not None or search.image_check.share(find) is None
        if unsure and self._waits_for_images(step, search):
            return Action(still, MissionState.APPROACHING, f"checking whether that is {display}")
        if objection is not None:
            return self._doubt(search, find, still, f"{objection}: going on")
        judged = search.judged(find)
        instead = contradiction(judged, in_words(search.goal.object))
        if instead is not None:
            return self._pass_by(search, find, still, instead)
        weighed = self._opinions.weigh(
            find,
            search.goal.goal_id,
            search.goal.described,
            step.frame,
            running=[one.goal.goal_id for one in step.searches],
        )
        if weighed.waiting:
            why = f"waiting for a second opinion on {display}"
            return Action(still, MissionState.APPROACHING, why)
        if weighed.opinion is not None:
            self._journal.note("opinion", weighed.sentence)
        if weighed.find.probability < min(self._find_from, find.probability):
            objection = f"is probably not one (p = {weighed.find.probability:.2f})"
            return self._doubt(search, find, still, f"{objection}, {weighed.sentence}: going on")
        opinion = weighed.opinion
        if opinion is not None:
            judged = by_model(judged, opinion.verdict, opinion.by or "the model")
        verified = replace(weighed.find, attributes=judged) if judged else weighed.find
        sentence = None if weighed.opinion is None else weighed.sentence
        if self._closer.begin(step, search, verified):
            self._verified = _Verified(search.goal.goal_id, verified, sentence)
            action = self._closer.act(step, search, verified)
            if action is not None:
                return action
        return self._announce(step, search, verified, sentence)

    def _waits_for_images(self, step: StepContext, search: Search) -> bool:
        """Return whether more images may tell; a frame whose image comes later tells nothing."""
        images, before = search.image_check.images, self._wait
        if before is None or before.goal_id != search.goal.goal_id:
            before = _Wait(search.goal.goal_id, 0.0, images - 1)
        if images == before.images:
            search.arrived_steps = max(self._confirm_steps, search.arrived_steps - 1)
        # While the robot is held no step comes here.
        waited_s = before.waited_s + min(step.dt_s, COMMAND_S)
        self._wait = _Wait(before.goal_id, waited_s, images)
        waited = search.arrived_steps - self._confirm_steps
        return waited < self._min_images and waited_s < self._most_wait_s

    def _end_closer(self, step: StepContext, search: Search) -> Action | None:
        """Go on to a verified find that was not close enough, and end the search there."""
        verified, self._verified = self._verified, None
        if verified is None or verified.goal_id != search.goal.goal_id:
            return None
        action = self._closer.act(step, search, verified.find)
        if action is not None:
            self._verified = verified
            return action
        now = same_find(search.candidates, verified.find, self._same_m)
        if now is None or gap_m(step.frame.T_world_base[:2, 3], now) > ARRIVED_M:
            # It has disappeared, or somebody has moved the robot away.
            return None
        find = replace(
            verified.find,
            position_world=now.position_world,
            size_m=now.size_m,
            voxels=now.voxels,
            box_px=now.box_px,
        )
        return self._announce(step, search, find, verified.sentence)

    def _announce(
        self, step: StepContext, search: Search, find: Find, sentence: str | None
    ) -> Action:
        """End the search with a find.

        Args:
            step: The present step.
            search: The search.
            find: The find.
            sentence: What the model said of it; None without a model.
        """
        search.announce(replace(find, stamp_ns=step.frame.stamp_ns))
        self._wait = None
        why = search.found_text(step.frame.T_world_base)
        if self._rooms.is_elsewhere(search, find):
            why = f"{why}, in another room than you said"
        if search.image_check.share(find) is None:
            why = f"{why}, not checked: too few images show it"
        if sentence is not None:
            why = f"{why}; {sentence}"
        self._journal.note(MissionState.FOUND.value, why, goal_id=search.goal.goal_id)
        return Action(Command(tilt_rad=step.frame.tilt_rad), MissionState.FOUND, why)

    def _pass_by(self, search: Search, find: Find, still: Command, instead: str) -> Action:
        """Exclude a find that is another one than was meant, and report what it is."""
        search.arrived_steps, self._wait = 0, None
        exclude_only(search, self._voxel_map, find)
        why = f"{instead}: continuing the search for {search.goal.display}"
        self._journal.note("doubted", why)
        return Action(still, MissionState.SEARCHING, why)

    def _doubt(self, search: Search, find: Find, still: Command, objection: str) -> Action:
        """Set a find aside and report why."""
        why = f"what seemed to be {search.goal.display} {objection}"
        set_aside(search, self._voxel_map, find)
        self._wait = None
        self._journal.note("doubted", why)
        return Action(still, MissionState.SEARCHING, why)

    def _find_here(self, step: StepContext, search: Search) -> Find | None:
        """Return the candidate in front of the robot; None if there is none."""
        candidates, T_world_base = search.candidates, step.frame.T_world_base
        plan = step.plan
        if plan.out_of_reach_m is not None:
            return find_from(candidates, T_world_base, plan.out_of_reach_m)
        # T(n) counts no voxel below or above these heights: it belongs to another storey.
        floor_z_m, view = float(T_world_base[2, 3]), self._view
        low_m, high_m = floor_z_m + view.object_low_m, floor_z_m + view.band_high_m
        candidates = at_heights(candidates, low_m, high_m)
        find = reached_find(candidates, T_world_base)
        if find is None and plan.ends_search:
            return nearest_find(candidates, T_world_base)
        return find

    def _objection(self, search: Search, find: Find) -> str | None:
        """Return the objection to a find; stricter if the operator's context contradicts it."""
        objection = search.objection(find, elsewhere=False)
        context = search.guidance.context
        if objection is not None:
            return objection
        elsewhere = contradicts_context(self._context, find, search.goal, context, self._voxel_map)
        if elsewhere or self._rooms.is_elsewhere(search, find):
            return search.objection(find, elsewhere=True)
        return None
