"""One goal and how far the search for it is."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array
from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.levels import Guidance
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.far_evidence import FarEvidence
from ippon.mapping.objects.object_layers import RuledOut
from ippon.mapping.objects.ooi_voxels import OoiVoxels
from ippon.mission.config import MissionConfig
from ippon.mission.finds.clusters import cluster_finds
from ippon.mission.finds.find_geometry import Ball, ball_round, distance_m, out_of_reach_text
from ippon.mission.finds.image_check import SecondLook
from ippon.mission.finds.termination import is_small, termination_voxels
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find
from ippon.planning.surface_scale import surface_scale

_UNSURE: Final = 2.5
"""So many times T_min a large thing shows at least of which the map is not sure."""
_SPECK: Final = 0.5
"""Share of T_min that is enough where no more shows: one voxel in place of two."""
_LARGE: Final = 1.25
_SMEAR_VOXELS: Final = 2.0
"""Nothing is larger than a large one of its kind by more than this share and so many voxels."""
_NEARBY_M: Final = 2.0
"""Of what is this near as much shows as ever will."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Doubted:
    """What the map took for the object: images or its size denied it, and it waits for the end."""

    ball: Ball
    share: float
    """How often it looked like the object."""
    too_large: bool
    """It is larger than the object can be."""
    ruled_out: list[RuledOut]
    """What the map held of it, and of what turned out to continue it."""


class Search:
    """One goal, its levels, what may be the object, and what was spent on it.

    Args:
        goal: What is searched for.
        guidance: Levels of the map's labels for that goal.
        config: How searches go.
    """

    def __init__(self, goal: Goal, guidance: Guidance, config: MissionConfig) -> None:
        self.goal = goal
        self.guidance = guidance
        self.candidates: tuple[Find, ...] = ()
        self.find: Find | None = None
        self.rejected: list[Ball] = []
        """What the operator said is not the object, and what the images denied twice."""
        self.doubted: list[Doubted] = []
        self.reconsidered: list[Ball] = []
        """What was doubted once: the next time it counts for what it looks like."""
        self.path_length_m = 0.0
        self.speck_will_do = False
        """A small thing showed less than T_min from nearby, and what showed was surely it."""
        self._termination_min = termination_voxels(
            goal.object, goal.category, config.map.voxel_size_m
        )
        self.arrived_steps = 0
        self.empty_steps = self.idle_steps = 0
        self._ooi_voxels = OoiVoxels(config.planner.ooi_threshold)
        self._centres: Float64Array = np.zeros((0, 3))
        self._small = is_small(goal.object, goal.category)
        self._longest_m = _LARGE * load_knowledge().size_m(goal.object)
        self._longest_m += _SMEAR_VOXELS * config.map.voxel_size_m
        scale = surface_scale(config.map.voxel_size_m) if self._small else 0.0
        self.second_look = SecondLook(
            config.second_look,
            goal.object,
            outline_voxels=config.second_look.outline_voxels * scale,
        )
        near_m = min(config.map.ooi_max_range_m, config.map.max_range_m)
        self.far_evidence = FarEvidence(
            config.far_evidence, goal.object, near_m, config.map.max_valid_depth_m
        )
        self._started_ns: int | None = None

    def elapsed_s(self, stamp_ns: int) -> float:
        """Return the age of the search in robot time."""
        return 0.0 if self._started_ns is None else (stamp_ns - self._started_ns) / NANOSECONDS

    def keep_time(self, last: Frame | None, frame: Frame) -> None:
        """Start the search's clock with its first frame."""
        if self._started_ns is None:
            self._started_ns = frame.stamp_ns
        elif last is not None and frame.stamp_ns < last.stamp_ns:
            # The robot's clock started anew: the search keeps the age that it had.
            self._started_ns += frame.stamp_ns - last.stamp_ns

    def add_way(self, last: Frame | None, frame: Frame) -> None:
        """Add what the robot drove since the frame before."""
        if last is not None:
            moved = frame.T_world_base[:3, 3] - last.T_world_base[:3, 3]
            self.path_length_m += float(np.linalg.norm(moved))

    def update_candidates(self, arrays: MapArrays, frame: Frame) -> None:
        """Look again for clusters of voxels that are probably the object."""
        self._centres, probabilities = self._ooi_voxels.update(arrays)
        self.candidates = cluster_finds(
            self._centres,
            probabilities,
            arrays.voxel_size,
            camera=frame.camera,
            T_world_camera=frame.T_world_camera,
        )

    def ask_image(self, frame: Frame) -> None:
        """Ask an image whether it shows the object where the map does, and where the map ends.

        The heatmap may have come late.
        """
        self.second_look.note(frame, self._centres, self.candidates)
        self.far_evidence.integrate(frame)

    def rests_of_ruled_out(self) -> list[tuple[Ball, Doubted | None]]:
        """Take what continues a rejected or doubted find from the candidates: the rest of it.

        Returns:
            What is to be ruled out with it, and the doubt that it belongs to, None for none.
        """
        rests: list[tuple[Ball, Doubted | None]] = []
        left: list[Find] = []
        for find in self.candidates:
            doubted = next((one for one in self.doubted if one.ball.touches(find)), None)
            if doubted is None and not any(ball.touches(find) for ball in self.rejected):
                left.append(find)
            else:
                rests.append((ball_round(find), doubted))
        self.candidates = tuple(left)
        return rests

    def is_reconsidered(self, find: Find) -> bool:
        """Tell whether a find was doubted before."""
        return any(ball.touches(find) for ball in self.reconsidered)

    @property
    def termination_min(self) -> float:
        """T_min: viewpoints that show more object voxels end the search."""
        return self._termination_min * (_SPECK if self.speck_will_do else 1.0)

    def shows_speck(self, T_world_base: Float64Array) -> bool:
        """Tell whether something nearby is surely the object, but too little of it shows.

        Args:
            T_world_base: Where the robot stands, its looks from nearby behind it.
        """
        return any(
            self._is_speck(c)
            and distance_m(T_world_base, c) <= _NEARBY_M
            and self.second_look.confirms(c)
            for c in self.candidates
        )

    def doubt(self, find: Find, *, elsewhere: bool) -> str | None:
        """Say what speaks against a find: the images, or that it is too little or too large.

        Args:
            find: Where the search would end.
            elsewhere: It is not where the operator said.

        Returns:
            What it does or is, as in "it hardly looks like it"; None where nothing speaks against
            it.
        """
        again = self.is_reconsidered(find)
        if self.is_too_large(find):
            return "is too large"
        if self._is_too_little(find) and not again:
            return "shows too little to be sure"
        if not self.second_look.contradicts(find, again=again, elsewhere=elsewhere):
            return None
        return "is not where you said" if elsewhere else "hardly looks like it"

    def is_too_large(self, find: Find) -> bool:
        """Tell whether a find is larger than any ordinary specimen."""
        return max(find.size_m) > self._longest_m

    def _is_too_little(self, find: Find) -> bool:
        if not self._small:
            sure = 1.0 if self.second_look.is_sure(find) else _UNSURE
            return find.voxels <= sure * self._termination_min
        speck = self.speck_will_do and self._is_speck(find)
        return speck and not self.second_look.confirms(find)

    def _is_speck(self, find: Find) -> bool:
        return self._small and find.voxels <= self._termination_min

    def go_on_from_find(self) -> Find | None:
        """Search on after a find that was none; returns that find."""
        find, self.find = self.find, None
        self.arrived_steps = self.empty_steps = self.idle_steps = 0
        self.speck_will_do = False
        return find

    def found_text(self, T_world_base: Float64Array) -> str:
        """Say what was found, and how far from the robot it is."""
        text = f"found {self.goal.display}"
        if self.find is None:
            return text
        if self.is_reconsidered(self.find):
            text = f"{text}, perhaps: nothing looks more like it"
        if self.find.out_of_reach_m is not None:
            return out_of_reach_text(self.goal.display, self.find.out_of_reach_m)
        size = f"{self.find.voxels} voxels" if self.find.voxels != 1 else "a single voxel"
        return (
            f"{text}: {size} at p = {self.find.probability:.2f}, "
            f"{distance_m(T_world_base, self.find):.1f} m away"
        )
