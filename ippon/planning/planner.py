"""The planner: grows the roadmap, evaluates its viewpoints and selects the one to go to.

One `step` is one increment of the anytime algorithm (Sec. Informative Path Planning). Counts bound
its work, so that two runs with one seed are identical; for a robot that waits,
`PlannerConfig.step_budget_s` bounds its time as well. After that time a step still takes over the
map's changes and does one piece of each kind of work (one new viewpoint, one evaluation, some
iterations of OMPL), so that all pending work is done in later steps.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.geometry import Float64Array, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.joint_evidence import EvidenceAhead
from ippon.mapping.objects.ooi_voxels import OoiVoxels, nearest_voxels
from ippon.planning.config import PlannerConfig
from ippon.planning.deadline import UNLIMITED, Clock, Deadline
from ippon.planning.plan import Plan, Viewpoint
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.roadmap_builder import RoadmapBuilder
from ippon.planning.roadmap.robot_path import shorten_path
from ippon.planning.roadmap.shortest_tree import RootEdges, ShortestTree
from ippon.planning.selection.closer_look import CloserLookSelector
from ippon.planning.selection.detours import Surroundings
from ippon.planning.selection.look_target import LookTarget
from ippon.planning.selection.node_selection import (
    Scores,
    holding_termination_min,
    max_gain_per_s,
    select,
)
from ippon.planning.selection.target_selector import TargetSelector
from ippon.planning.terrain.second_chances import SecondChances
from ippon.planning.terrain.traversability import Traversability
from ippon.planning.terrain.unseen_gaps import UnseenGapDetector
from ippon.planning.terrain.unseen_shortcut import unseen_shortcut_m
from ippon.planning.tree_export import TreeExporter
from ippon.planning.visibility.evaluation_scheduler import EvaluationScheduler
from ippon.planning.visibility.region_weights import Stroke, WeightGrid
from ippon.planning.visibility.viewpoint_store import ViewpointStore
from ippon.robot import RobotProfile


class ViewpointPlanner:
    """The paper's planner; it keeps its roadmap as long as the map lasts."""

    def __init__(
        self, config: PlannerConfig, robot: RobotProfile, seed: int, clock: Clock | None = None
    ) -> None:
        """Begin with an empty roadmap.

        Args:
            config: Parameters of all parts.
            robot: Body, camera and speed.
            seed: Seed of the samples.
            clock: Measures `config.step_budget_s`.

        Raises:
            ValueError: There is a budget in seconds and no clock.
        """
        self.config = config
        self._clock = clock
        self._deadline()
        self._floor = Traversability(config.traversability, robot)
        self._roadmap = Roadmap(config.max_nodes, config.reserved_nodes)
        self._viewpoints = ViewpointStore(
            config.view, robot, config.max_nodes, config.ooi_threshold
        )
        self._scheduler = EvaluationScheduler(config.evaluation, self._roadmap, self._viewpoints)
        self._selector = TargetSelector(
            config.selection, self._roadmap, self._viewpoints, robot.max_yaw_rate_rad_s
        )
        self._builder = RoadmapBuilder(
            config.sampling,
            config.narrow_passages,
            config.connection,
            config.local_planner,
            robot,
            seed,
            samples_per_step=config.samples_per_step,
            floor=self._floor,
            roadmap=self._roadmap,
        )
        self._closer_look = CloserLookSelector(config.closer_look, robot.max_linear_m_s)
        self._gaps = UnseenGapDetector(config.unseen_gap)
        self._objects = OoiVoxels(config.ooi_threshold)
        self._termination_min = math.inf
        self._levels_changed = self._goal_changed = False
        self._tree: ShortestTree | None = None
        self._chances = SecondChances(self._floor, config.second_chances)

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """Recompute every gain for a new goal; see `Planner.set_goal`."""
        self.set_levels(probabilities=probabilities, termination_min=termination_min)
        self._goal_changed = True
        self._closer_look.reset()
        # What the goal before had opened stays closed until this one has nothing else.
        self._chances.begin()

    def set_levels(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """Recompute every gain; what was looked at for this goal stays so."""
        self._termination_min = termination_min
        self._viewpoints.set_probabilities(probabilities)
        self._levels_changed = True
        self._selector.reset()

    def set_termination_min(self, termination_min: float) -> None:
        """See `Planner.set_termination_min`."""
        self._termination_min = termination_min

    def set_searching(self, searching: bool, *, counts: bool = True) -> None:
        """See `Planner.set_searching`."""
        self._chances.set_searching(searching, counts=counts)
        self._closer_look.counts = counts

    def set_far_evidence(self, far_evidence: EvidenceAhead | None) -> None:
        """See `Planner.set_far_evidence`."""
        self._viewpoints.set_far_evidence(far_evidence)

    def set_regions(self, strokes: Sequence[Stroke], rooms: WeightGrid | None = None) -> None:
        """Weigh every viewpoint by the painted regions and the rooms that it sees."""
        if self._viewpoints.set_regions(strokes, rooms):
            self._selector.reset()

    def preview(self, map_arrays: MapArrays, *, cues: bool) -> Viewpoint | None:
        """Return the target that other levels of the map would give; the planner does not change.

        Args:
            map_arrays: The map of the last step, with other levels.
            cues: Whether far evidence of labels that are certainly near the object still counts.

        Returns:
            The viewpoint; None if none has enough gain, or before the first step.
        """
        if self._tree is None:
            return None
        viewpoints = self._viewpoints.copy()
        if not cues:
            viewpoints.cued = np.zeros_like(viewpoints.cued)
        viewpoints.recount_levels(map_arrays)
        scores = self._selector.score(self._tree, self._termination_min, viewpoints)
        return self._exporter(viewpoints, self._tree, scores).target(select(scores, None), None)

    def note_height(self, z_m: float) -> None:
        """See `Planner.note_height`."""
        self._floor.note_height(z_m)

    def mark_contact(self, T_world_base: Float64Array, motion: Command | None = None) -> None:
        """Close the triangular region ahead of the robot (Sec. Traversability)."""
        self._floor.mark_contact(T_world_base, motion)
        self._selector.path = None

    def mark_unreachable(self, xy: tuple[float, float]) -> None:
        """Close the floor at a point, as after a contact, until nothing else is left to reach."""
        self._floor.mark_unreachable(xy)

    def step(self, map_arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> Plan:
        """Extend roadmap and evaluations by one increment and return the best plan so far.

        A step that its time budget ends returns the best target that a known path leads to.

        Args:
            map_arrays: The map, with the image taken from here in it.
            T_world_base: Pose of the robot.
            tilt_rad: Tilt of its camera.
        """
        deadline = self._deadline()
        growth = deadline.share(self.config.growth_share)
        x, y, yaw = float(T_world_base[0, 3]), float(T_world_base[1, 3]), yaw_of(T_world_base)
        standing = self._update(map_arrays, T_world_base, tilt_rad)
        reachable = self._builder.reachable(x, y)
        objects = self._objects.update(map_arrays)[0]
        objects = nearest_voxels(objects, x, y, self.config.max_object_voxels)
        potential, selector = self._viewpoints.potential, self._selector
        self._forget(self._builder.thin_out(objects, potential, selector.node, x, y))
        saturated = self._builder.sample(objects, reachable, x, y, growth)
        self._add_root(objects, map_arrays, x, y)
        root_edges, tree = self._builder.shortest_tree(
            reachable, x, y, yaw, growth, target=selector.node, path=selector.path
        )
        evaluated = self._scheduler.step(
            map_arrays, tree, objects, deadline, target=selector.node, standing=standing
        )
        chosen, scores = selector.choose(map_arrays, tree, self._termination_min, deadline)
        around = self._surroundings(map_arrays, reachable)
        look = self._look_closer(
            chosen, scores, objects, around, tree, T_world_base, cut_short=growth.cut_short
        )
        selector.set_target(chosen, scores, look, (x, y))
        path = self._path_to_target(tree, root_edges, yaw, deadline)
        grown = saturated and not growth.cut_short
        done = grown and selector.node is None and not self._gain_is_left(map_arrays, tree)
        exhausted = done and not self._chances.relax()
        self._tree, exporter = tree, self._exporter(self._viewpoints, tree, scores)
        return Plan(
            target=exporter.target(selector.node, look),
            path_world=np.column_stack([path, np.full(len(path), self._floor.floor_z_m)]),
            tree=exporter.tree_view(x, y, yaw, tilt_rad),
            exhausted=exhausted,
            evaluated=evaluated,
            closer_look=look is not None,
            out_of_reach_m=None if look is None else look.away_m,
            unseen_shortcut_m=unseen_shortcut_m(around.grid, around.limits, around.margin_m, path),
            floor_gap=self._gaps.step(self._floor, reachable, (x, y), deadline),
            free_turn_rad=self._floor.free_turn(T_world_base),
            floor_z_m=self._floor.floor_z_m,
            cut_short=deadline.cut_short,
            max_gain_per_s=max_gain_per_s(self.config.selection, scores),
            full=self._roadmap.room == 0,
        )

    def path_to_point(self, T_world_base: Float64Array, xy: Float64Array) -> Float64Array | None:
        """See `RoadmapBuilder.path_to_point`; the floor is that of the last `step`.

        Without a search, narrow gaps are opened only for a point that no other path leads to.
        """
        if self._chances.close_for(xy):
            self._forget(self._builder.update_floor(self._floor.everywhere))
        path = self._path_to_point(T_world_base, xy)
        if path is None and self._chances.open_for(xy):
            path = self._path_to_point(T_world_base, xy)
        return path

    def _path_to_point(self, T_world_base: Float64Array, xy: Float64Array) -> Float64Array | None:
        selector = self._selector
        return self._builder.path_to_point(
            T_world_base, xy, self._deadline(), target=selector.node, path=selector.path
        )

    def _deadline(self) -> Deadline:
        budget_s = self.config.step_budget_s
        return UNLIMITED if budget_s is None else Deadline(budget_s, self._clock)

    def _update(self, arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> bool:
        """Take over the map's changes; return whether the robot has reached its target."""
        box = self._floor.update(arrays, T_world_base)
        if self._levels_changed:
            # Another goal may have other ranges, with which `update` drops what is counted here.
            self._viewpoints.recount_levels(arrays)
            self._levels_changed = False
        standing_at = self._selector.standing_at(
            float(T_world_base[0, 3]), float(T_world_base[1, 3])
        )
        self._viewpoints.update(
            arrays,
            self._floor.floor_z_m,
            T_world_base,
            tilt_rad,
            standing_at,
            termination_min=self._termination_min,
        )
        if self._goal_changed:
            self._viewpoints.begin_goal(arrays)
            self._goal_changed = False
        if box is not None:
            self._forget(self._builder.update_floor(box))
        return standing_at is not None

    def _forget(self, nodes: list[int]) -> None:
        """Clear the evaluations of removed nodes: new nodes may take their numbers."""
        for node in nodes:
            self._viewpoints.forget(node)
            self._selector.forget(node)

    def _add_root(self, voxels: Float64Array, arrays: MapArrays, x: float, y: float) -> None:
        """Add and evaluate the robot's own position if the search may end there.

        On the way to a terminating viewpoint the object may already be within reach.
        """
        config, target = self.config, self._selector.node
        enough = holding_termination_min(config.selection, self._termination_min)
        apart = config.sampling.robot_spacing_m
        if target is None or self._viewpoints.termination[target] <= enough:
            if not self._closer_look.active:
                return
            apart = config.sampling.object_spacing_m
        else:
            reach = self._viewpoints.geometry.ranges.termination_m
            if np.hypot(voxels[:, 0] - x, voxels[:, 1] - y).min(initial=math.inf) > reach:
                return
        node = self._builder.add_here(x, y, apart)
        if node is not None:
            self._viewpoints.evaluate(node, self._roadmap.xy[node], arrays)

    def _surroundings(self, arrays: MapArrays, reachable: NDArray[np.uint8]) -> Surroundings:
        floor, geometry = self._floor, self._viewpoints.geometry
        return Surroundings(floor.grid, floor.limits, floor.margin_m, reachable, arrays, geometry)

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
    ) -> LookTarget | None:
        """Return the closer look at what may be the object; None if the target ends the search."""
        if target is not None and scores.terminating[target]:
            self._closer_look.cancel()
            return None
        look = self._closer_look.choose(
            voxels,
            around,
            tree,
            self._roadmap.xy,
            T_world_base,
            termination_min=self._termination_min,
            cut_short=cut_short,
        )
        if look is None or look.away_m is None:
            return look
        if self._chances.relax_for_look():
            self._closer_look.out_of_reach.reopen()
            return None
        place = self._closer_look.out_of_reach.wanted_place()
        if place is not None:
            self._builder.add_at(place)
        return look

    def _gain_is_left(self, arrays: MapArrays, tree: ShortestTree) -> bool:
        """Return whether a viewpoint whose evaluation is pending may be worth going to."""
        min_potential = 0.5 * self.config.selection.min_gain
        return self._scheduler.any_worth_evaluating(arrays, tree, min_potential)

    def _path_to_target(
        self, tree: ShortestTree, root_edges: RootEdges, yaw: float, deadline: Deadline
    ) -> Float64Array:
        """Return and keep the (K, 2) points of the path to the target, K = 0 without one."""
        selector = self._selector
        if selector.node is None:
            selector.path = None
            return np.zeros((0, 2))
        path = self._roadmap.path_to(selector.node, tree, root_edges)
        selector.path = shorten_path(path, self._floor, yaw, deadline)
        return selector.path

    def _exporter(
        self, viewpoints: ViewpointStore, tree: ShortestTree, scores: Scores
    ) -> TreeExporter:
        xy, floor_z_m = self._roadmap.xy, self._floor.floor_z_m
        min_gain = self.config.selection.min_gain
        return TreeExporter(viewpoints, xy, floor_z_m, tree, scores, min_gain=min_gain)
