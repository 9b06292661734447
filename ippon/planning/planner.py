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

from ippon.geometry import Float64Array, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.mapping.glimpses import Glimpses
from ippon.mapping.ooi_voxels import OoiVoxels
from ippon.planning.closer_look import CloserLooks
from ippon.planning.config import PlannerConfig
from ippon.planning.connection import COMFORT_M, Connector
from ippon.planning.deadline import UNLIMITED, Clock, Deadline
from ippon.planning.floor_gap import GAP_M, unseen_gap
from ippon.planning.gaze import Look
from ippon.planning.local_queries import LocalQueries
from ippon.planning.path_from_robot import shorten
from ippon.planning.picture import TreePicture
from ippon.planning.plan import Plan, Viewpoint
from ippon.planning.promise import promise, waits
from ippon.planning.regions import RegionWeights
from ippon.planning.roadmap import Roadmap
from ippon.planning.roadmap_entry import RoadmapEntry
from ippon.planning.sampler import Sampler
from ippon.planning.sampling import STANDABLE, cell_centres, crowded_nodes, reachable_cells
from ippon.planning.selection import (
    Commitment,
    Patience,
    Scores,
    commit,
    held,
    score_nodes,
    select,
    with_passing,
)
from ippon.planning.shortest_tree import Seeds, ShortestTree
from ippon.planning.straight_way import unseen_straight_m
from ippon.planning.traversability import Traversability
from ippon.planning.viewpoints import Viewpoints
from ippon.planning.ways_round import Surroundings
from ippon.robot import RobotProfile

WAYPOINT_REACH_M = 0.75
"""A point that an operator chose may lie this far from where the robot can stand: on a table."""
_GAP_STEPS: Final = 5
_GAP_PATIENCE_STEPS: Final = 10
"""After so many it is looked for however late it is."""
_GAP_WITHIN_M: Final = 1.6
"""Farther away than this a look down shows little of the floor."""
_MOST_OBJECT_VOXELS = 512
"""More of them tell nothing new of where to look."""
_THIN_STEPS: Final = 5
"""A roadmap that is full all the same is looked through no more often than this."""
_BESIDE_M = 0.12
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
        self._turn_rate = robot.max_yaw_rate_rad_s
        self._floor = Traversability(config.traversability, robot)
        self._road = Roadmap(config.max_nodes)
        self._views = Viewpoints(config.view, robot, config.max_nodes, config.ooi_threshold)
        self._queries = LocalQueries(config.local_planner, self._floor, seed)
        self._connector = Connector(self._road, self._floor, self._queries, robot)
        self._entry = RoadmapEntry(self._road, self._floor, self._queries, robot)
        self._sampler = Sampler(
            config.sampling, config.samples_per_step, self._road, self._floor, self._connector, seed
        )
        self._closer = CloserLooks(config.closer_look, robot.max_linear_m_s)
        self._objects = OoiVoxels(config.ooi_threshold)
        self._termination_min = math.inf
        self._levels_changed = False
        self._target: int | None = None
        self._path: Float64Array | None = None
        self._commitment: Commitment | None = None
        self._patience = Patience()
        self._tree: ShortestTree | None = None
        self._second_chances = 0
        self._since_gap = 0
        self._gap: tuple[float, float] | None = None
        self._since_thinned = 0
        self._oldest_waits = False

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """Weigh everything anew for a new goal or other levels; no ray is cast for it.

        Args:
            probabilities: (4,) p_img by level.
            termination_min: T_min; viewpoints that show more object voxels end the search.
        """
        self._termination_min = termination_min
        self._views.set_probabilities(probabilities)
        self._levels_changed = True
        self._target = self._path = self._commitment = None
        self._patience = Patience()
        self._closer.forget()
        self._second_chances = self.config.second_chances

    def set_termination_min(self, termination_min: float) -> None:
        """See `Planner.set_termination_min`."""
        self._termination_min = termination_min

    def follow_glimpses(self, glimpses: Glimpses | None) -> None:
        """Weigh every viewpoint by what images show beyond the map's range, from now on."""
        self._views.set_glimpses(glimpses)

    def set_regions(self, regions: RegionWeights | None) -> None:
        """Weigh every viewpoint by what the operator painted; None for nothing painted."""
        self._views.set_regions(regions)
        self._target = self._path = self._commitment = None
        self._patience = Patience()

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
        views = self._views
        self._views = views.copy()
        try:
            if not cues:
                self._views.cued = np.zeros_like(self._views.cued)
            self._views.recount(map_arrays)
            scores = self._score(self._tree)
            target = select(self.config.selection, scores, None)
            picture = self._picture(self._tree, scores)
            return None if target is None else picture.viewpoint(target)
        finally:
            self._views = views

    def mark_contact(self, T_world_base: Float64Array) -> None:
        """Take the triangular region ahead of the robot for untraversable (Sec. Traversability)."""
        self._floor.mark_contact(T_world_base)
        self._path = None

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
        box = self._floor.update(map_arrays, T_world_base)
        standing_at = self._standing_at(x, y)
        self._views.follow(map_arrays, self._floor.floor_z_m, T_world_base, tilt_rad, standing_at)
        if self._levels_changed:
            self._views.memory.forget_surfaces()
            self._views.recount(map_arrays)
            self._levels_changed = False
        if box is not None:
            for node in self._connector.follow(box):
                self._forget(node)
        grid, limits = self._floor.grid, self._floor.limits
        reachable = reachable_cells(grid, limits, x, y, self._floor.margin_m, COMFORT_M)
        objects = self._objects.update(map_arrays)[0][:_MOST_OBJECT_VOXELS]
        self._make_room(objects, x, y)
        saturated = self._sampler.add(objects, reachable, x, y, layout)
        self._sampler.add_gates(reachable, layout)
        self._add_root(objects, map_arrays, x, y)
        seeds, tree = self._grow_tree(reachable, x, y, yaw, layout)
        evaluated = self._evaluate(map_arrays, tree, objects, deadline, standing_at is not None)
        target, scores = self._choose(map_arrays, tree, deadline)
        margin_m = self._floor.margin_m
        around = Surroundings(grid, limits, margin_m, reachable, map_arrays, self._views)
        look = self._look_closer(
            target, scores, objects, around, tree, T_world_base, cut_short=layout.cut_short
        )
        gain = self._views.gain
        self._commitment = commit(
            scores, gain, None if look is not None else target, self._commitment
        )
        if look is None:
            self._patience.note(self._target, target, (x, y))
        target = target if look is None else look.node
        way = None if target is None else self._road.path_to(target, tree, seeds)
        path = np.zeros((0, 2)) if way is None else shorten(way, self._floor, yaw, deadline)
        self._target, self._path = target, (None if way is None else path)
        laid_out = saturated and not layout.cut_short
        exhausted = laid_out and target is None and not self._promising_left(map_arrays, tree)
        if exhausted and self._second_chances > 0:
            # Before giving up, try what contacts closed, and the narrowest gaps.
            self._second_chances -= 1
            exhausted = not self._floor.relax()
        self._tree = tree
        picture = self._picture(tree, scores)
        viewpoint = None if target is None else picture.viewpoint(target)
        if viewpoint is not None and look is not None:
            viewpoint = replace(viewpoint, yaw_rad=look.yaw_rad, tilt_rad=look.tilt_rad)
        floor_gap = self._floor_gap(reachable, x, y, deadline)
        return Plan(
            target=viewpoint,
            path_world=np.column_stack([path, np.full(len(path), self._floor.floor_z_m)]),
            tree=picture.tree_view(x, y, yaw, tilt_rad),
            exhausted=exhausted,
            evaluated=evaluated,
            closer_look=look is not None,
            out_of_reach_m=None if look is None else look.away_m,
            unseen_straight_m=unseen_straight_m(grid, limits, margin_m, path),
            floor_gap=floor_gap,
            cut_short=deadline.cut_short,
            promised_per_s=self._promised_per_s(scores),
            full=self._road.room == 0,
        )

    def _deadline(self) -> Deadline:
        budget_s = self.config.step_budget_s
        return UNLIMITED if budget_s is None else Deadline(budget_s, self._clock)

    def _floor_gap(
        self, reachable: NDArray[np.uint8], x: float, y: float, deadline: Deadline
    ) -> tuple[float, float] | None:
        """Look for one now and then, and say so while it stays the same: most close by driving."""
        self._since_gap += 1
        if self._since_gap < _GAP_STEPS:
            return None
        if self._since_gap < _GAP_PATIENCE_STEPS and deadline.passed():
            return None
        self._since_gap = 0
        floor, before = self._floor, self._gap
        self._gap = unseen_gap(
            floor.grid, floor.limits, floor.margin_m, reachable, (x, y), _GAP_WITHIN_M
        )
        if before is None or self._gap is None or math.dist(before, self._gap) > GAP_M:
            return None
        return self._gap

    def _promised_per_s(self, scores: Scores) -> float:
        explores = (scores.ratio > 0.0) & ~scores.terminating
        seconds = scores.path_cost[explores] + self.config.selection.look_s
        return float((scores.path_gain[explores] / seconds).max(initial=0.0))

    def _picture(self, tree: ShortestTree, scores: Scores) -> TreePicture:
        return TreePicture(
            self._views,
            self._road.xy,
            self._floor.floor_z_m,
            tree,
            scores,
            min_gain=self.config.selection.min_gain,
        )

    def way_to(self, T_world_base: Float64Array, xy: Float64Array) -> Float64Array | None:
        """Find the way to a point that the operator chose, over the roadmap of the last `step`.

        Args:
            T_world_base: Where the robot stands.
            xy: (2,) world x and y, metres.

        Returns:
            (K, 2) points from the robot to where it can stand nearest to `xy`; None when that is
            farther than `WAYPOINT_REACH_M` away, or nothing leads there.
        """
        x, y = float(T_world_base[0, 3]), float(T_world_base[1, 3])
        grid, limits = self._floor.grid, self._floor.limits
        reachable = reachable_cells(grid, limits, x, y, self._floor.margin_m, COMFORT_M)
        cells = np.argwhere(reachable == STANDABLE)
        if not len(cells):
            return None
        places = cell_centres(grid, cells)
        apart = np.hypot(*(places - xy).T)
        if apart.min() > WAYPOINT_REACH_M:
            return None
        seeds, tree = self._grow_tree(reachable, x, y, yaw_of(T_world_base), self._deadline())
        return self._entry.way_to(places[int(np.argmin(apart))], T_world_base, seeds, tree)

    def _standing_at(self, x: float, y: float) -> Float64Array | None:
        """Position of the target when the robot has come to it."""
        if self._target is None:
            return None
        at = self._road.xy[self._target]
        return at if math.hypot(at[0] - x, at[1] - y) <= 0.2 else None

    def _forget(self, node: int) -> None:
        self._views.forget(node)
        if self._target == node:
            self._target = self._path = self._commitment = None

    def _make_room(self, voxels: Float64Array, x: float, y: float) -> None:
        """Thin out a full roadmap where the robot no longer is: it was sampled densely there."""
        config, road = self.config, self._road
        self._since_thinned += 1
        if road.room > config.samples_per_step or self._since_thinned < _THIN_STEPS:
            return
        self._since_thinned = 0
        nodes = road.nodes
        xy = road.xy[nodes]
        worth: Float64Array = self._views.potential[nodes].astype(np.float64)
        worth[np.hypot(xy[:, 0] - x, xy[:, 1] - y) <= config.sampling.local_radius_m] = math.inf
        worth[nodes == self._target] = math.inf
        if len(voxels):
            away = np.linalg.norm(xy[:, None] - voxels[None, :, :2], axis=2).min(axis=1)
            worth[away <= config.sampling.object_reach_m] = math.inf
        crowded = [int(nodes[k]) for k in crowded_nodes(xy, worth, config.sampling.spacing_m)]
        self._connector.thin_out(crowded)
        for node in crowded:
            self._forget(node)

    def _add_root(self, voxels: Float64Array, arrays: MapArrays, x: float, y: float) -> None:
        """Evaluate where the robot stands, too, once the object is within reach from there.

        On the way to a viewpoint the search may be over before that is reached.
        """
        target = self._target
        enough, apart = held(self.config.selection, self._termination_min), _BESIDE_M
        if target is None or self._views.termination[target] <= enough:
            if not self._closer.active:
                return
            apart = self.config.sampling.object_spacing_m
        else:
            reach = self.config.view.termination_range_m
            if np.hypot(voxels[:, 0] - x, voxels[:, 1] - y).min(initial=math.inf) > reach:
                return
        node = self._sampler.add_here(x, y, apart)
        if node is not None:
            self._views.evaluate(node, self._road.xy[node], arrays)

    def _grow_tree(
        self, reachable: NDArray[np.uint8], x: float, y: float, yaw: float, deadline: Deadline
    ) -> tuple[Seeds, ShortestTree]:
        seeds = self._entry.seeds(x, y, yaw, self._target, self._path, deadline)
        rate = self._turn_rate
        tree = self._road.shortest_tree(seeds, yaw, rate)
        if self._connector.bridge(tree, reachable, deadline=deadline):
            tree = self._road.shortest_tree(seeds, yaw, rate)
        return seeds, tree

    def _evaluate(
        self,
        arrays: MapArrays,
        tree: ShortestTree,
        voxels: Float64Array,
        deadline: Deadline,
        standing: bool,
    ) -> int:
        """Bring the most promising viewpoints up to date; at least one, however late it is."""
        nodes = tree.order
        stale = self._views.stale(nodes, self._road.xy, arrays.voxel_size)
        if standing:
            # Looks alone change nothing in the map, but they use up what there is to see.
            stale |= nodes == self._target
        nodes = nodes[stale]
        if not len(nodes):
            return 0
        worth = promise(
            nodes, self._road.nodes, self._road.xy, self._views, voxels, target=self._target
        )
        worth /= tree.cost[nodes] + 1.0
        chosen = nodes[np.argsort(-worth, kind="stable")[: self.config.evaluations_per_step - 1]]
        # One place in each step is for whoever waited longest, so that nobody waits for ever.
        oldest = int(nodes[np.argmin(self._views.evaluated[nodes])])
        due = [oldest] if self._oldest_waits else []
        evaluated: set[int] = set()
        for node in dict.fromkeys([*due, *chosen.tolist(), oldest]):
            if evaluated and deadline.passed():
                break
            self._views.evaluate(node, self._road.xy[node], arrays)
            evaluated.add(node)
        self._oldest_waits = oldest not in evaluated
        return len(evaluated)

    def _choose(
        self, arrays: MapArrays, tree: ShortestTree, deadline: Deadline
    ) -> tuple[int | None, Scores]:
        """Select the target; one whose surroundings changed is looked at again first.

        One that there is no time left for is the first that the next step looks at.
        """
        stay = self._patience.stay_factor(self.config.selection)
        for _ in range(4):
            scores = self._score(tree)
            target = self._select(scores, stay)
            if target is None:
                return None, scores
            one = np.array([target])
            fresh = not self._views.stale(one, self._road.xy, arrays.voxel_size)[0]
            if fresh or deadline.passed():
                return target, scores
            self._views.evaluate(target, self._road.xy[target], arrays)
        scores = self._score(tree)
        return self._select(scores, stay), scores

    def _select(self, scores: Scores, stay: float) -> int | None:
        left = self._left(scores)
        return select(self.config.selection, scores, self._target, stay, left)

    def _left(self, scores: Scores) -> float:
        """Share of what the way to the target promised that is left, 1 where that says nothing."""
        commitment = self._commitment
        if commitment is None or commitment.node != self._target:
            return 1.0
        nat, cued = self._views.glimpsed_by(commitment.node)
        # What images show from afar is looked at from nearby, however little is unseen there.
        return 1.0 if nat > 0.0 or cued else commitment.left(scores)

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
        if self._second_chances > 0:
            # Before that is said, try what contacts closed, and the narrowest gaps.
            self._second_chances -= 1
            if self._floor.relax():
                self._closer.out_of_reach.think_again()
                return None
        place = self._closer.out_of_reach.wanted_place()
        if place is not None:
            self._sampler.add_at(place)
        return look

    def _score(self, tree: ShortestTree) -> Scores:
        n, views, selection = len(tree.cost), self._views, self.config.selection
        eligible = views.potential[:n] >= selection.min_gain
        yaw = views.yaw[:n].copy()
        for node in np.flatnonzero(views.termination[:n] > held(selection, self._termination_min)):
            yaw[node] = views.frames_object(int(node))[0]
        scores = score_nodes(
            selection,
            tree,
            gain=views.gain[:n],
            by_heading=views.by_heading[:n],
            termination=views.termination[:n],
            yaw=yaw,
            eligible=eligible,
            termination_min=self._termination_min,
            turn_rate=self._turn_rate,
            current=self._target,
        )
        if self._commitment is None or self._commitment.node != self._target:
            return scores
        return with_passing(selection, scores, views.gain, self._commitment)

    def _promising_left(self, arrays: MapArrays, tree: ShortestTree) -> bool:
        """Tell whether a viewpoint waits to be evaluated that might be worth going to."""
        stale = self._views.stale(tree.order, self._road.xy, arrays.voxel_size)
        return waits(tree.order[stale], self._views, 0.5 * self.config.selection.min_gain)
