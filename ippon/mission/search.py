"""The state of one search."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array
from ippon.guidance.levels import Guidance
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.far_evidence import FarEvidence
from ippon.mapping.goal_layers.goal_layers import GoalLayer
from ippon.mapping.objects.ooi_suppression import SuppressedRegion
from ippon.mapping.objects.ooi_voxels import OoiVoxels
from ippon.mission.config import MissionConfig
from ippon.mission.finds.attributes.attribute_check import (
    AttributeCheck,
    attributes_text,
)
from ippon.mission.finds.clusters import cluster_finds
from ippon.mission.finds.find_geometry import (
    ExclusionSphere,
    distance_m,
    exclusion_of_itself,
    exclusion_sphere,
    exhausted_text,
    out_of_reach_text,
)
from ippon.mission.finds.image_check import ImageCheck
from ippon.mission.finds.size_check import SizeCheck
from ippon.mission.goal import Goal
from ippon.mission.snapshot import OVER, Find, JudgedAttribute, MissionState
from ippon.observation_model import ObservationModels
from ippon.planning.surface_scale import surface_scale
from ippon.vocabulary import in_words


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SetAside:
    """A candidate that images or its size contradict; it may be reconsidered at the end."""

    region: ExclusionSphere
    share: float
    """Share of its pixels that looked like the object."""
    too_large: bool
    excluded: list[SuppressedRegion]
    """The map's evidence for it, and for what later turned out to continue it."""


class Search:
    """State of the search for one goal: levels, candidates, and what was ruled out.

    Args:
        goal: The object.
        guidance: Levels of the map's labels for it.
        config: Parameters of the search.
        models: Observation models of the networks; None for the defaults.
        layer: The map's evidence for the goal if it has several; None for its only one.
    """

    def __init__(
        self,
        goal: Goal,
        guidance: Guidance,
        config: MissionConfig,
        models: ObservationModels | None = None,
        layer: GoalLayer | None = None,
    ) -> None:
        self.goal = goal
        self.layer = layer
        self.guidance = guidance
        self.exclusion = config.exclusion
        self.state = MissionState.STARTING
        self.candidates: tuple[Find, ...] = ()
        """Clusters of voxels that may be the object, largest first."""
        self.find: Find | None = None
        """The find that ended the search."""
        self.counted: list[Find] = []
        """Finds before the present one, of a goal of which several are wanted."""
        self.refused: list[Find] = []
        """Finds that the operator rejected."""
        self.cancelled = False
        self.dismissed = False
        """The map is no longer updated for a goal of a tour: it was confirmed or cancelled."""
        self.rejected: list[ExclusionSphere] = []
        """Regions that the operator rejected, that images contradicted twice, that an attribute
        contradicted, or that were counted."""
        self.set_aside: list[SetAside] = []
        self.reconsidered: list[ExclusionSphere] = []
        """Regions that were set aside once: images must contradict them more strongly."""
        self.path_length_m = 0.0
        self.relaxed_termination = False
        """Less than T_min voxels of a small object are enough, since they surely belong to it."""
        self.arrived_steps = 0
        """Steps at a terminating viewpoint, less those elsewhere."""
        self.empty_steps = self.idle_steps = 0
        """Steps in a row without a viewpoint, and without one that has enough gain."""
        self._size = SizeCheck(config.size_check, goal, config.map.voxel_size_m)
        self._sure = config.image_check.sure
        self._ooi_voxels = OoiVoxels(config.planner.ooi_threshold)
        self._threshold = config.planner.ooi_threshold
        self._centres: Float64Array = np.zeros((0, 3))
        scale = surface_scale(config.map.voxel_size_m) if self._size.small else 0.0
        self.image_check = ImageCheck(
            config.image_check,
            goal.object,
            outline_voxels=config.image_check.outline_voxels * scale,
            models=models,
        )
        self.attribute_check = AttributeCheck(
            config.attribute_check, goal.object, goal.attributes, config.map.voxel_size_m, models
        )
        near_m = min(config.map.ooi_max_range_m, config.map.max_range_m)
        self.far_evidence = FarEvidence(
            config.far_evidence, goal.object, near_m, config.map.max_valid_depth_m
        )
        self._started_ns: int | None = None
        self._last_number = 0

    @property
    def over(self) -> bool:
        """The search has ended."""
        return self.cancelled or self.state in OVER

    @property
    def wants_more(self) -> bool:
        """Return whether the search goes on after the present find."""
        count = self.goal.count
        return count == "all" or len(self.counted) + 1 < count

    @property
    def finds(self) -> tuple[Find, ...]:
        """All finds that are not rejected: those that were counted, and the present one."""
        return (*self.counted, *filter(None, (self.find,)))

    def find_numbered(self, number: int | None) -> Find | None:
        """Return one of `finds` by its number; None for the present one."""
        if number is None:
            return self.find
        return next((find for find in self.finds if find.number == number), None)

    def name_of(self, find: Find | None) -> str:
        """Return the object in the operator's words; of several, one thing with its number."""
        if find is None or self.goal.count == 1:
            return self.goal.display
        return f"{in_words(self.goal.object)} {find.number}"

    def announce(self, find: Find) -> None:
        """Set the find that ends the search."""
        self.find = self.numbered(find)

    def numbered(self, find: Find) -> Find:
        """Return a find with its number: the next one unless it has one from an earlier run."""
        number = find.number or self._last_number + 1
        self._last_number = max(self._last_number, number)
        return replace(find, number=number)

    def confirm(self, find: Find) -> None:
        """Note that the operator has confirmed one of `finds`."""
        confirmed = replace(find, confirmed=True)
        if self.find == find:
            self.find = confirmed
        else:
            self.counted[self.counted.index(find)] = confirmed

    def advance(self, last: Frame | None, frame: Frame) -> None:
        """Add the time since the last frame, and the path until the object is found."""
        if self._started_ns is None:
            self._started_ns = frame.stamp_ns
        elif last is not None and frame.stamp_ns < last.stamp_ns:
            # The robot's clock was reset; the age of the search does not change.
            self._started_ns += frame.stamp_ns - last.stamp_ns
        if last is not None and self.state is not MissionState.FOUND:
            moved = frame.T_world_base[:3, 3] - last.T_world_base[:3, 3]
            self.path_length_m += float(np.linalg.norm(moved))

    def observe(self, frame: Frame) -> None:
        """Compare an image with the candidates, and with the space beyond the map's range.

        The heatmap may belong to an earlier frame.
        """
        self.image_check.observe(frame, self._centres, self.candidates)
        self.attribute_check.observe(frame, self.candidates)
        self.far_evidence.integrate(frame)

    def elapsed_s(self, stamp_ns: int) -> float:
        """Return the age of the search in robot time, seconds."""
        return 0.0 if self._started_ns is None else (stamp_ns - self._started_ns) / NANOSECONDS

    def update_candidates(self, arrays: MapArrays, frame: Frame) -> None:
        """Cluster the voxels that are probably the object."""
        if self.layer is None:
            self._centres, probabilities = self._ooi_voxels.update(arrays)
        else:
            self._centres, probabilities = self.layer.voxels(self._threshold)
        self.candidates = cluster_finds(
            self._centres,
            probabilities,
            arrays.voxel_size,
            camera=frame.camera,
            T_world_camera=frame.T_world_camera,
            is_too_large=self.is_too_large,
            sure=self._sure,
        )

    def take_continuations(self) -> list[tuple[ExclusionSphere, SetAside | None]]:
        """Remove the candidates that continue a rejected or set-aside find.

        Returns:
            The regions to exclude as well, each with the entry of `set_aside` that it continues;
            None where it continues a rejected find.
        """
        continuations: list[tuple[ExclusionSphere, SetAside | None]] = []
        left: list[Find] = []
        for find in self.candidates:
            entry = next((e for e in self.set_aside if self._continues(find, (e.region,))), None)
            whole = entry or next((r for r in self.rejected if self._continues(find, (r,))), None)
            if whole is None:
                left.append(find)
            elif isinstance(whole, ExclusionSphere) and whole.alone:
                continuations.append((exclusion_of_itself(find, whole.margin_m), None))
            else:
                continuations.append((exclusion_sphere(self.exclusion, find), entry))
        self.candidates = tuple(left)
        return continuations

    def is_rejected(self, find: Find) -> bool:
        """Return whether a find is part of one that was rejected."""
        return self._continues(find, self.rejected)

    def is_set_aside(self, find: Find) -> bool:
        """Return whether a find is part of one that was set aside and may be reconsidered."""
        return self._continues(find, (one.region for one in self.set_aside))

    def is_reconsidered(self, find: Find) -> bool:
        """Return whether a find was set aside before."""
        return self._continues(find, self.reconsidered)

    def _continues(self, find: Find, regions: Iterable[ExclusionSphere]) -> bool:
        longest_m = self._size.longest_m
        return any(region.is_continued_by(find, longest_m) for region in regions)

    @property
    def termination_min(self) -> float:
        """T_min: viewpoints that show more object voxels end the search."""
        share = self._size.config.relaxed_share if self.relaxed_termination else 1.0
        return self._size.termination_min * share

    def shows_single_voxel(self, T_world_base: Float64Array) -> bool:
        """Return whether a nearby candidate is surely the object, but too small for T_min.

        Args:
            T_world_base: Pose of the robot.
        """
        return any(
            self._size.is_single_voxel(c)
            and distance_m(T_world_base, c) <= self._size.config.near_m
            and self.image_check.confirms(c)
            for c in self.candidates
        )

    def is_too_large(self, find: Find) -> bool:
        """Return whether a find is larger than any ordinary specimen."""
        return self._size.is_too_large(find)

    def objection(self, find: Find, *, elsewhere: bool) -> str | None:
        """Return the evidence against a find: its size, or the images.

        Args:
            find: The find that would end the search.
            elsewhere: It is not where the operator said.

        Returns:
            A predicate such as "hardly looks like it"; None if nothing contradicts the find.
        """
        again = self.is_reconsidered(find)
        if self._size.is_too_large(find):
            return "is too large"
        if self._is_too_little(find) and not again:
            return "shows too little to be sure"
        if not self.image_check.contradicts(find, again=again, elsewhere=elsewhere):
            return None
        return "is not where you said" if elsewhere else "hardly looks like it"

    def judged(self, find: Find) -> tuple[JudgedAttribute, ...]:
        """Return what was said of the object, judged on a find."""
        others = [one for one in self.candidates if one.position_world != find.position_world]
        return self.attribute_check.judge(find, others)

    def _is_too_little(self, find: Find) -> bool:
        if not self._size.small:
            return self._size.is_too_little(find, sure=self.image_check.is_sure(find))
        single = self.relaxed_termination and self._size.is_single_voxel(find)
        return single and not self.image_check.confirms(find)

    def drop_find(self) -> Find | None:
        """Continue after the find that ended the search; returns that find."""
        find, self.find = self.find, None
        self.arrived_steps = self.empty_steps = self.idle_steps = 0
        self.relaxed_termination = False
        return find

    def end(self) -> None:
        """End the search since nothing is left to explore.

        All are found if everything reachable was seen and at least one was.
        """
        self.state = MissionState.EXHAUSTED
        if self.goal.count == "all" and self.counted:
            self.find = self.counted.pop()
            self.state = MissionState.FOUND

    def ended_text(self, *, full: bool = False) -> str:
        """Return why nothing is left to explore and what was found, for the operator.

        Args:
            full: The roadmap had no room for more viewpoints.
        """
        return exhausted_text(
            self.goal.display,
            self.candidates,
            full=full,
            found=len(self.finds),
            wanted=self.goal.count,
        )

    def found_text(self, T_world_base: Float64Array) -> str:
        """Return what was found and how far from the robot, for the operator."""
        text = f"found {self.goal.display}"
        if self.find is None:
            return text
        away_m = self.find.out_of_reach_m
        if away_m is not None:
            text = out_of_reach_text(self.goal.display, away_m)
        if self.is_reconsidered(self.find):
            text = f"{text}, perhaps: nothing looks more like it"
        if away_m is None:
            size = f"{self.find.voxels} voxels" if self.find.voxels != 1 else "a single voxel"
            text = (
                f"{text}: {size} at p = {self.find.probability:.2f}, "
                f"{distance_m(T_world_base, self.find):.1f} m away"
            )
        return "; ".join(filter(None, [text, attributes_text(self.find.attributes)]))
