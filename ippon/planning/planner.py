"""The planner: grows viewpoints, keeps what they promise up to date, says where to go next.

One `step` is one increment of the anytime algorithm (Sec. Informative Path Planning). Its work is
bounded by counts, so that two runs of one seed are the same run, and for a robot that waits by
`PlannerConfig.step_budget_s` as well. Past that, it still follows the map's changes and does one
piece of each kind of work (a viewpoint added, one evaluated, some iterations of OMPL), so that
whatever is left gets its turn in the steps that follow.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.geometry import Float64Array, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.far_evidence import FarEvidence
from ippon.mapping.objects.ooi_voxels import OoiVoxels
from ippon.planning.config import PlannerConfig
from ippon.planning.deadline import UNLIMITED, Clock, Deadline
from ippon.planning.plan import Plan, Viewpoint
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.robot_path import shorten
from ippon.planning.roadmap.shortest_tree import Seeds, ShortestTree
from ippon.planning.selection.approach import CloserLooks
from ippon.planning.selection.detours import Surroundings
from ippon.planning.selection.look_target import Look
from ippon.planning.selection.node_selection import Scores, held, promised_per_s, select
from ippon.planning.selection.target_choice import TargetChoice
from ippon.planning.terrain.traversability import Traversability
from ippon.planning.terrain.unseen_floor import unseen_straight_m
from ippon.planning.terrain.unseen_gaps import GapWatch
from ippon.planning.tree_growth import TreeGrowth
from ippon.planning.tree_view import TreePicture
from ippon.planning.visibility.evaluation_schedule import Evaluations
from ippon.planning.visibility.region_weights import RegionWeights
from ippon.planning.visibility.viewpoints import Viewpoints
from ippon.robot import RobotProfile

_MOST_OBJECT_VOXELS: Final = 512
"""More of them tell nothing new of where to look."""
_BESIDE_M: Final = 0.12
"""A viewpoint this near to the robot is where it stands."""
_LAYOUT_SHARE: Final = 0.6
"""Of a step's seconds, those for adding and joining viewpoints; the others are for evaluating them:
a local way that OMPL looks for in vain would take all of them."""


class ViewpointPlanner:
    """Owns the tree of viewpoints; lives as long as the map does."""

    def __init__(
        self, config: PlannerConfig, robot: RobotProfile, seed: int, clock: Clock | None = None
    ) -> None:
        """Begin with an empty tree.

        Args:
            config: How it is grown.
            robot: Body, camera and speed.
            seed: Of the samples.
            clock: What `config.step_budget_s` is kept by.

        Raises:
            ValueError: There is a budget in seconds and no clock.
        """
        self.config = config
        self._clock = clock
        self._deadline()
        self._floor = Traversability(config.traversability, robot)
        self._road = Roadmap(config.max_nodes)
        self._views = Viewpoints(config.view, robot, config.max_nodes, config.ooi_threshold)
        self._evaluations = Evaluations(config.evaluations_per_step, self._road, self._views)
        self._choice = TargetChoice(
            config.selection, self._road, self._views, robot.max_yaw_rate_rad_s
        )
        self._growth = TreeGrowth(
            config,
            robot,
            seed,
            floor=self._floor,
            road=self._road,
            views=self._views,
            choice=self._choice,
        )
        self._closer = CloserLooks(config.closer_look, robot.max_linear_m_s)
        self._gaps = GapWatch()
        self._objects = OoiVoxels(config.ooi_threshold)
        self._termination_min = math.inf
        self._levels_changed = False
        self._tree: ShortestTree | None = None
        self._second_chances = 0

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """Weigh everything anew for a new goal or other levels; no ray is cast for it.

        Args:
            probabilities: (4,) p_img by level.
            termination_min: T_min; viewpoints that show more object voxels end the search.
        """
        self._termination_min = termination_min
        self._views.set_probabilities(probabilities)
        self._levels_changed = True
        self._choice.reset()
        self._closer.forget()
        self._second_chances = self.config.second_chances

    def set_termination_min(self, termination_min: float) -> None:
        """See `Planner.set_termination_min`."""
        self._termination_min = termination_min

    def set_far_evidence(self, far_evidence: FarEvidence | None) -> None:
        """Weigh every viewpoint by what images show beyond the map's range, from now on."""
        self._views.set_far_evidence(far_evidence)

    def set_regions(self, regions: RegionWeights | None) -> None:
        """Weigh every viewpoint by what the operator painted; None for nothing painted."""
        self._views.set_regions(regions)
        self._choice.reset()

    def preview(self, map_arrays: MapArrays, *, cues: bool) -> Viewpoint | None:
        """Tell what would be chosen if the map's levels were these; nothing changes by it.

        Args:
            map_arrays: The map of the last step, with other levels.
            cues: Whether what is certain for the object would still be so, also from afar.

        Returns:
            The viewpoint, None when none would be worth it or there was no step yet.
        """
        if self._tree is None:
            return None
        views = self._views.copy()
        if not cues:
            views.cued = np.zeros_like(views.cued)
        views.recount(map_arrays)
        scores = self._choice.score(self._tree, self._termination_min, views)
        target = select(self.config.selection, scores, None)
        picture = self._picture(views, self._tree, scores)
        return None if target is None else picture.viewpoint(target)

    def mark_contact(self, T_world_base: Float64Array, motion: Command | None = None) -> None:
        """Take the triangular region ahead of the robot for untraversable (Sec. Traversability)."""
        self._floor.mark_contact(T_world_base, motion)
        self._choice.path = None

    def step(self, map_arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> Plan:
        """Grow the tree by one increment and return the best plan so far.

        With a budget in seconds that is what is known when they are used up: a target is still one
        that a known way leads to.

        Args:
            map_arrays: The map, with the image taken from here in it.
            T_world_base: Where the robot stands.
            tilt_rad: Its camera's tilt.
        """
        deadline = self._deadline()
        layout = deadline.share(_LAYOUT_SHARE)
        x, y, yaw = float(T_world_base[0, 3]), float(T_world_base[1, 3]), yaw_of(T_world_base)
        standing = self._follow(map_arrays, T_world_base, tilt_rad)
        reachable = self._growth.reachable(x, y)
        objects = self._objects.update(map_arrays)[0][:_MOST_OBJECT_VOXELS]
        saturated = self._growth.lay_out(objects, reachable, x, y, layout)
        self._add_root(objects, map_arrays, x, y)
        seeds, tree = self._growth.grow(reachable, x, y, yaw, layout)
        evaluated = self._evaluations.step(
            map_arrays, tree, objects, deadline, target=self._choice.node, standing=standing
        )
        chosen, scores = self._choice.choose(map_arrays, tree, self._termination_min, deadline)
        around = self._surroundings(map_arrays, reachable)
        look = self._look_closer(
            chosen, scores, objects, around, tree, T_world_base, cut_short=layout.cut_short
        )
        self._choice.settle(chosen, scores, look, (x, y))
        path = self._way_to_target(tree, seeds, yaw, deadline)
        laid_out = saturated and not layout.cut_short
        done = laid_out and self._choice.node is None and not self._promising_left(map_arrays, tree)
        exhausted = done and not self._try_harder()
        self._tree = tree
        picture = self._picture(self._views, tree, scores)
        floor_gap = self._gaps.step(self._floor, reachable, (x, y), deadline)
        return Plan(
            target=_target_of(picture, self._choice.node, look),
            path_world=np.column_stack([path, np.full(len(path), self._floor.floor_z_m)]),
            tree=picture.tree_view(x, y, yaw, tilt_rad),
            exhausted=exhausted,
            evaluated=evaluated,
            closer_look=look is not None,
            out_of_reach_m=None if look is None else look.away_m,
            unseen_straight_m=unseen_straight_m(around.grid, around.limits, around.margin_m, path),
            floor_gap=floor_gap,
            cut_short=deadline.cut_short,
            promised_per_s=promised_per_s(self.config.selection, scores),
            full=self._road.room == 0,
        )

    def way_to(self, T_world_base: Float64Array, xy: Float64Array) -> Float64Array | None:
        """See `TreeGrowth.way_to`; the roadmap is that of the last `step`."""
        return self._growth.way_to(T_world_base, xy, self._deadline())

    def _deadline(self) -> Deadline:
        budget_s = self.config.step_budget_s
        return UNLIMITED if budget_s is None else Deadline(budget_s, self._clock)

    def _follow(self, arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> bool:
        """Take over what changed in the map; tell whether the robot has come to its target."""
        box = self._floor.update(arrays, T_world_base)
        standing_at = self._choice.standing_at(float(T_world_base[0, 3]), float(T_world_base[1, 3]))
        self._views.follow(arrays, self._floor.floor_z_m, T_world_base, tilt_rad, standing_at)
        if self._levels_changed:
            self._views.memory.forget_surfaces()
            self._views.recount(arrays)
            self._levels_changed = False
        if box is not None:
            self._growth.follow(box)
        return standing_at is not None

    def _add_root(self, voxels: Float64Array, arrays: MapArrays, x: float, y: float) -> None:
        """Evaluate where the robot stands, too, once the object is within reach from there.

        On the way to a viewpoint the search may be over before that is reached.
        """
        target = self._choice.node
        enough, apart = held(self.config.selection, self._termination_min), _BESIDE_M
        if target is None or self._views.termination[target] <= enough:
            if not self._closer.active:
                return
            apart = self.config.sampling.object_spacing_m
        else:
            reach = self.config.view.termination_range_m
            if np.hypot(voxels[:, 0] - x, voxels[:, 1] - y).min(initial=math.inf) > reach:
                return
        node = self._growth.add_here(x, y, apart)
        if node is not None:
            self._views.evaluate(node, self._road.xy[node], arrays)

    def _surroundings(self, arrays: MapArrays, reachable: NDArray[np.uint8]) -> Surroundings:
        floor = self._floor
        return Surroundings(
            floor.grid, floor.limits, floor.margin_m, reachable, arrays, self._views
        )

    def _look_closer(
        self,
        target: int | None,
        scores: Scores,
        voxels: Float64Array,
        around: Surroundings,
        tree: ShortestTree,
        T_world_base: Float64Array,
        *,
        cut_short: bool,
    ) -> Look | None:
        """Look closer at what may be the object, unless the target ends the search."""
        if target is not None and scores.terminating[target]:
            self._closer.rest()
            return None
        look = self._closer.choose(
            voxels,
            around,
            tree,
            self._road.xy,
            T_world_base,
            termination_min=self._termination_min,
            cut_short=cut_short,
        )
        if look is None or look.away_m is None:
            return look
        if self._try_harder():
            self._closer.out_of_reach.think_again()
            return None
        place = self._closer.out_of_reach.wanted_place()
        if place is not None:
            self._growth.add_at(place)
        return look

    def _try_harder(self) -> bool:
        """Before giving up, try what contacts closed, and the narrowest gaps; tell if it is new."""
        if self._second_chances == 0:
            return False
        self._second_chances -= 1
        return self._floor.relax()

    def _promising_left(self, arrays: MapArrays, tree: ShortestTree) -> bool:
        """Tell whether a viewpoint waits to be evaluated that might be worth going to."""
        return self._evaluations.promising_left(arrays, tree, 0.5 * self.config.selection.min_gain)

    def _way_to_target(
        self, tree: ShortestTree, seeds: Seeds, yaw: float, deadline: Deadline
    ) -> Float64Array:
        """Return the (K, 2) points of the way to the target, K = 0 without one; remember it."""
        choice = self._choice
        if choice.node is None:
            choice.path = None
            return np.zeros((0, 2))
        way = self._road.path_to(choice.node, tree, seeds)
        choice.path = shorten(way, self._floor, yaw, deadline)
        return choice.path

    def _picture(self, views: Viewpoints, tree: ShortestTree, scores: Scores) -> TreePicture:
        return TreePicture(
            views,
            self._road.xy,
            self._floor.floor_z_m,
            tree,
            scores,
            min_gain=self.config.selection.min_gain,
        )


def _target_of(picture: TreePicture, node: int | None, look: Look | None) -> Viewpoint | None:
    """Return a node as others see it, facing the way of a closer look; None for none."""
    if node is None:
        return None
    viewpoint = picture.viewpoint(node)
    if look is None:
        return viewpoint
    return replace(viewpoint, yaw_rad=look.yaw_rad, tilt_rad=look.tilt_rad)
