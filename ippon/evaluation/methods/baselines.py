"""Other ways to choose where to go, on the same map, body, controller and termination rule."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.evaluation.methods.frontiers import FloorRoutes, Frontier, find_frontiers
from ippon.evaluation.methods.value_map import ValueMap
from ippon.frame import Frame
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.guidance.levels import Level
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.far_evidence import FarEvidence
from ippon.planning.config import PlannerConfig
from ippon.planning.plan import NodeKind, Plan, Viewpoint
from ippon.planning.planner import ViewpointPlanner
from ippon.planning.terrain.floor_grid import cell_centre
from ippon.planning.terrain.traversability import Traversability
from ippon.robot import RobotProfile

_TILT_RAD: Final = -0.25
"""Camera tilt while looking over a frontier: floor and furniture."""
_SAME_FRONTIER_M: Final = 0.6
"""A frontier whose middle moved less than this is the one the robot is on its way to."""
_NEAR_M: Final = 0.3
_SETTLED_STEPS: Final = 8
"""Steps at a target that does not go away, after which it is given up."""
_PATIENCE_STEPS: Final = 200
"""Steps on the way to one target, after which it is given up."""
_GIVEN_UP_M: Final = 0.5
_DISCOUNT_PER_S: Final = 0.1
"""Discount of a view by the time it takes to get there: e-fold in 10 s."""
_STAY: Final = 1.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Aim:
    """Where a rule wants the robot to go, and to look."""

    stand: tuple[float, float]
    """Where to stand, metres."""
    yaw_rad: float
    tilt_rad: float
    worth: float
    about: tuple[float, float]
    """What is to be seen there: tells one target from the next."""


Untried = Callable[[tuple[float, float]], bool]
"""Tells whether what lies at a point has not been given up."""


class Rule(Protocol):
    """Chooses where to go while the object has not been found."""

    def observe(self, frame: Frame) -> None:
        """Look at a frame before the planner's step."""
        ...

    def probabilities(self, probabilities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the p_img by level that the tree's gains are made from."""
        ...

    def choose(
        self, plan: Plan, routes: FloorRoutes, last: Aim | None, untried: Untried
    ) -> Aim | None:
        """Return the next aim, None when nothing is left to explore.

        Args:
            plan: The tree of viewpoints, with their gains.
            routes: The floor.
            last: What the robot is on its way to.
            untried: False for what was given up.
        """
        ...


class BaselinePlanner:
    """Explores by a rule; stops, and gives up, as the paper's planner does.

    The paper's planner runs beside the rule, since all methods end a search alike: at a viewpoint
    that shows enough of the object, or when no reachable viewpoint promises anything. So its own
    choice of where to explore counts only when the rule has nothing left, which spares a frontier
    planner the failures of stopping when the floor is seen and the shelves are not. What looks
    like the object is approached by the same rule, as VLFM does at once, too. A planner step takes
    longer than that of a bare frontier planner.
    """

    def __init__(self, config: PlannerConfig, robot: RobotProfile, seed: int, rule: Rule) -> None:
        self._rule = rule
        self._tree = ViewpointPlanner(config, robot, seed)
        self._floor = Traversability(config.traversability, robot)
        self._aim: Aim | None = None
        self._age = 0
        self._settled = 0
        self._given_up: list[tuple[float, float]] = []

    def observe(self, frame: Frame) -> None:
        """Show the rule a frame before the step that it belongs to."""
        self._rule.observe(frame)

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """See `Planner.set_goal`."""
        self._tree.set_goal(
            probabilities=self._rule.probabilities(probabilities), termination_min=termination_min
        )
        self._aim = None
        self._given_up.clear()

    def set_termination_min(self, termination_min: float) -> None:
        """See `Planner.set_termination_min`."""
        self._tree.set_termination_min(termination_min)

    def set_far_evidence(self, far_evidence: FarEvidence | None) -> None:
        """Leave them alone: no method in the literature that is compared here has them."""

    def mark_contact(self, T_world_base: Float64Array, motion: Command | None = None) -> None:
        """See `Planner.mark_contact`."""
        self._tree.mark_contact(T_world_base, motion)
        self._floor.mark_contact(T_world_base, motion)

    def step(self, map_arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> Plan:
        """See `Planner.step`."""
        plan = self._tree.step(map_arrays, T_world_base, tilt_rad)
        self._floor.update(map_arrays, T_world_base)
        ends = plan.target is not None and plan.target.kind is NodeKind.TERMINATING
        if ends or plan.closer_look:
            self._aim = None
            return plan
        routes = FloorRoutes(self._floor, float(T_world_base[0, 3]), float(T_world_base[1, 3]))
        self._watch(T_world_base)
        aim = self._rule.choose(plan, routes, self._aim, self._is_untried)
        self._age = self._age + 1 if _is_same(aim, self._aim) else 0
        self._aim = aim
        cell = None if aim is None else routes.nearest_cell(*aim.stand, _NEAR_M)
        if aim is None or cell is None:
            return plan
        return self._plan_to(aim, cell, plan, routes)

    def _is_untried(self, about: tuple[float, float]) -> bool:
        return all(math.dist(about, old) > _GIVEN_UP_M for old in self._given_up)

    def _watch(self, T_world_base: Float64Array) -> None:
        """Give up a target that stays although the robot is there, or that it never reaches."""
        aim = self._aim
        if aim is None:
            return
        near = math.dist(aim.stand, (T_world_base[0, 3], T_world_base[1, 3])) < _NEAR_M
        facing = abs(wrap_angle(aim.yaw_rad - yaw_of(T_world_base))) < 0.3
        self._settled = self._settled + 1 if near and facing else 0
        if self._settled >= _SETTLED_STEPS or self._age >= _PATIENCE_STEPS:
            self._given_up.append(aim.about)
            self._aim, self._age, self._settled = None, 0, 0

    def _plan_to(self, aim: Aim, cell: tuple[int, int], plan: Plan, routes: FloorRoutes) -> Plan:
        path = routes.path_to(cell)
        z = self._floor.floor_z_m
        x, y = path[-1].tolist()
        target = Viewpoint(
            position_world=(x, y, z),
            yaw_rad=aim.yaw_rad,
            tilt_rad=aim.tilt_rad,
            gain=aim.worth,
            termination=0.0,
            level=Level.AVERAGE,
            kind=NodeKind.EXPLORING,
            path_gain=aim.worth,
            path_cost_s=float(routes.time_s[cell]),
        )
        path_world = np.column_stack([path, np.full(len(path), z)])
        return replace(
            plan, target=target, path_world=path_world, exhausted=False, unseen_shortcut_m=0.0
        )


class NearestFrontier:
    """Goes to the frontier that takes the least time (Yamauchi 1997); knows nothing of objects."""

    def observe(self, frame: Frame) -> None:
        """Ignore it."""

    def probabilities(self, probabilities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Count every unknown voxel alike."""
        return _flat(probabilities)

    def choose(
        self, plan: Plan, routes: FloorRoutes, last: Aim | None, untried: Untried
    ) -> Aim | None:
        """See `Rule.choose`; a frontier is kept until it is gone."""
        del plan
        frontiers = [f for f in find_frontiers(routes) if untried(f.position)]
        if not frontiers:
            return None
        kept = None if last is None else _nearest_to(frontiers, last.about)
        best = kept or min(frontiers, key=lambda f: f.time_s)
        return _over(best, routes, 1.0 / (1.0 + best.time_s))


class SemanticFrontier:
    """Goes to the frontier of highest value (VLFM, Yokoyama et al. 2024)."""

    def __init__(self, level_of: Mapping[str, float]) -> None:
        """Value what is seen by l(O | C) of each common label."""
        self._values = ValueMap(level_of)

    def observe(self, frame: Frame) -> None:
        """Update the value map."""
        self._values.observe(frame)

    def probabilities(self, probabilities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Leave them for when no frontier is left."""
        return probabilities

    def choose(
        self, plan: Plan, routes: FloorRoutes, last: Aim | None, untried: Untried
    ) -> Aim | None:
        """See `Rule.choose`; a frontier is kept while no other is worth clearly more."""
        del plan
        frontiers = [f for f in find_frontiers(routes) if untried(f.position)]
        if not frontiers:
            return None
        value = {f: self._values.value_near(*f.position) for f in frontiers}
        # Of equal ones, as where nothing was valued yet, the nearest.
        best = max(frontiers, key=lambda f: (value[f], -f.time_s))
        kept = None if last is None else _nearest_to(frontiers, last.about)
        # VLFM keeps its frontier unless its value has fallen by more than this.
        if kept is not None and last is not None and value[kept] + 0.01 >= last.worth:
            best = kept
        return _over(best, routes, value[best])


class GreedyNextBestView:
    """Goes to the viewpoint that shows the most per second, weighing neither way nor semantics.

    The gain of each viewpoint is the paper's with every level average; gains on the way do not
    count, and distance discounts them as in Bircher et al. 2016, eq. (3).
    """

    def observe(self, frame: Frame) -> None:
        """Ignore it."""

    def probabilities(self, probabilities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Count every unknown voxel alike."""
        return _flat(probabilities)

    def choose(
        self, plan: Plan, routes: FloorRoutes, last: Aim | None, untried: Untried
    ) -> Aim | None:
        """See `Rule.choose`; a viewpoint is kept while no other is worth clearly more."""
        del routes
        tree = plan.tree
        worth = tree.gains[1:] * np.exp(-_DISCOUNT_PER_S * tree.path_costs_s[1:])
        worth[tree.kinds[1:] == NodeKind.MINIMAL] = 0.0
        xy = tree.positions_world[1:, :2].astype(np.float64)
        for row in np.flatnonzero(worth > 0.0):
            if not untried((float(xy[row, 0]), float(xy[row, 1]))):
                worth[row] = 0.0
        if not (worth > 0.0).any():
            return None if plan.exhausted else last
        best = int(np.argmax(worth))
        if last is not None:
            apart = np.hypot(*(xy - last.stand).T)
            kept = int(np.argmin(apart))
            if apart[kept] < 0.1 and _STAY * worth[kept] >= worth[best]:
                best = kept
        stand = (float(xy[best, 0]), float(xy[best, 1]))
        return Aim(
            stand=stand,
            yaw_rad=float(tree.yaws_rad[best + 1]),
            tilt_rad=float(tree.tilts_rad[best + 1]),
            worth=float(worth[best]),
            about=stand,
        )


def _flat(probabilities: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.full_like(probabilities, probabilities[int(Level.AVERAGE)])


def _nearest_to(frontiers: list[Frontier], about: tuple[float, float]) -> Frontier | None:
    """Return the frontier that an aim was about, None when it is gone."""
    nearest = min(frontiers, key=lambda f: math.dist(f.position, about))
    return nearest if math.dist(nearest.position, about) <= _SAME_FRONTIER_M else None


def _over(frontier: Frontier, routes: FloorRoutes, worth: float) -> Aim:
    return Aim(
        stand=cell_centre(routes.grid, *frontier.cell),
        yaw_rad=frontier.yaw_rad,
        tilt_rad=_TILT_RAD,
        worth=worth,
        about=frontier.position,
    )


def _is_same(one: Aim | None, other: Aim | None) -> bool:
    if one is None or other is None:
        return False
    return math.dist(one.about, other.about) <= _SAME_FRONTIER_M
