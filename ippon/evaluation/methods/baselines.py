"""Baseline exploration rules, with the same map, body, controller and termination rule."""

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
from ippon.mapping.far_evidence.joint_evidence import EvidenceAhead
from ippon.planning.config import PlannerConfig
from ippon.planning.plan import NodeKind, Plan, Viewpoint
from ippon.planning.planner import ViewpointPlanner
from ippon.planning.terrain.floor_grid import cell_centre
from ippon.planning.terrain.traversability import Traversability
from ippon.robot import RobotProfile

_LONGEST_REASON: Final = 100
_TILT_RAD: Final = -0.25
"""Camera tilt while looking over a frontier: floor and furniture."""
_SAME_FRONTIER_M: Final = 0.6
"""Distance between frontier centres below which two frontiers count as one."""
_NEAR_M: Final = 0.3
_SETTLED_STEPS: Final = 8
"""Steps at a target that remains, after which it is abandoned."""
_PATIENCE_STEPS: Final = 200
"""Steps without coming nearer to a target, after which it is abandoned."""
_NEARER_S: Final = 0.1
"""Travel time by which the robot has come nearer."""
_GIVEN_UP_M: Final = 0.5
_DISCOUNT_PER_S: Final = 0.1
"""Discount rate of a view by its travel time: a factor of e in 10 s."""
_STAY: Final = 1.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Aim:
    """Target of a rule: position and view."""

    stand: tuple[float, float]
    """Position of the robot, metres."""
    yaw_rad: float
    tilt_rad: float
    worth: float
    about: tuple[float, float]
    """Centre of the view, metres; identifies the target."""
    reason: str = ""
    """Why it was chosen, a few words: shown while the robot goes there, and recorded."""

    def __post_init__(self) -> None:
        if len(self.reason) > _LONGEST_REASON:
            raise ValueError(
                f"the reason of an aim has at most {_LONGEST_REASON} characters; got "
                f"{len(self.reason)}"
            )
        numbers = (*self.stand, self.yaw_rad, self.tilt_rad, *self.about)
        if not all(math.isfinite(number) for number in numbers):
            raise ValueError(f"an aim has finite numbers; got {self}")


Untried = Callable[[tuple[float, float]], bool]
"""Tells whether a target at a point has not been abandoned."""


class Rule(Protocol):
    """An exploration rule: chooses targets until the object is found."""

    def observe(self, frame: Frame) -> None:
        """Process a frame before the planner's step."""
        ...

    def probabilities(self, probabilities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the p_img by level for the gains of the tree."""
        ...

    def choose(
        self, plan: Plan, routes: FloorRoutes, last: Aim | None, untried: Untried
    ) -> Aim | None:
        """Return the next target, None if nothing is left to explore.

        Args:
            plan: The tree of viewpoints, with their gains.
            routes: The floor.
            last: The current target, or None.
            untried: False for abandoned targets.
        """
        ...


class BaselinePlanner:
    """Explores by a rule; terminates as the paper's planner does.

    The paper's planner runs alongside, because all methods end a search by the same rule: at a
    viewpoint that shows enough of the object, or when no reachable viewpoint has gain left. Its own
    exploration targets are used only after the rule has none left, which spares frontier planners
    the failures of stopping when the floor is mapped and the shelves are not. Possible objects are
    approached by the same rule, as VLFM does. A step takes longer than that of a bare frontier
    planner.
    """

    def __init__(self, config: PlannerConfig, robot: RobotProfile, seed: int, rule: Rule) -> None:
        self._rule = rule
        self._tree = ViewpointPlanner(config, robot, seed)
        self._floor = Traversability(config.traversability, robot)
        self._aim: Aim | None = None
        self._age = 0
        self._left_s = math.inf
        """Least travel time to the target that was left so far."""
        self._settled = 0
        self._given_up: list[tuple[float, float]] = []

    def observe(self, frame: Frame) -> None:
        """Pass a frame to the rule before its step."""
        self._rule.observe(frame)

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """See `Planner.set_goal`."""
        self._tree.set_goal(
            probabilities=self._rule.probabilities(probabilities), termination_min=termination_min
        )
        self._aim = None
        self._given_up.clear()

    def set_levels(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """See `Planner.set_levels`."""
        self._tree.set_levels(
            probabilities=self._rule.probabilities(probabilities), termination_min=termination_min
        )
        self._aim = None

    def set_termination_min(self, termination_min: float) -> None:
        """See `Planner.set_termination_min`."""
        self._tree.set_termination_min(termination_min)

    def set_searching(self, searching: bool, *, counts: bool = True) -> None:
        """See `Planner.set_searching`."""
        self._tree.set_searching(searching, counts=counts)

    def set_far_evidence(self, far_evidence: EvidenceAhead | None) -> None:
        """Ignore it: the published baselines do not use such evidence."""

    def path_to_point(self, T_world_base: Float64Array, xy: Float64Array) -> Float64Array | None:
        """See `PathPlanner.path_to_point`: the last step to a find is that of all methods."""
        return self._tree.path_to_point(T_world_base, xy)

    def note_height(self, z_m: float) -> None:
        """See `Planner.note_height`."""
        self._tree.note_height(z_m)
        self._floor.note_height(z_m)

    def mark_contact(self, T_world_base: Float64Array, motion: Command | None = None) -> None:
        """See `Planner.mark_contact`."""
        self._tree.mark_contact(T_world_base, motion)
        self._floor.mark_contact(T_world_base, motion)

    def mark_unreachable(self, xy: tuple[float, float]) -> None:
        """See `Planner.mark_unreachable`."""
        self._tree.mark_unreachable(xy)
        self._floor.mark_unreachable(xy)

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
        if _is_same(aim, self._aim):
            self._age += 1
        else:
            self._age, self._left_s = 0, math.inf
        self._aim = aim
        cell = None if aim is None else routes.nearest_cell(*aim.stand, _NEAR_M)
        if aim is None or cell is None:
            return replace(plan, by_rule=False)
        left_s = float(routes.time_s[cell])
        if left_s < self._left_s - _NEARER_S:
            self._age, self._left_s = 0, left_s
        return self._plan_to(aim, cell, plan, routes)

    def _is_untried(self, about: tuple[float, float]) -> bool:
        return all(math.dist(about, old) > _GIVEN_UP_M for old in self._given_up)

    def _watch(self, T_world_base: Float64Array) -> None:
        """Abandon a target that remains although the robot is there, or that it never reaches."""
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
            plan, target=target, path_world=path_world, exhausted=False, unseen_shortcut_m=0.0,
            by_rule=True, rule_reason=aim.reason,
        )  # fmt: skip


class WithoutSemantics:
    """A rule that does not use what the images show."""

    def observe(self, frame: Frame) -> None:
        """Do nothing."""

    def probabilities(self, probabilities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return equal weights for every unknown voxel."""
        return np.full_like(probabilities, probabilities[int(Level.AVERAGE)])


class NearestFrontier(WithoutSemantics):
    """Frontier with the least travel time (Yamauchi 1997); no semantics."""

    def choose(
        self, plan: Plan, routes: FloorRoutes, last: Aim | None, untried: Untried
    ) -> Aim | None:
        """See `Rule.choose`; a frontier is kept until it disappears."""
        del plan
        frontiers = [f for f in find_frontiers(routes) if untried(f.position)]
        if not frontiers:
            return None
        kept = None if last is None else _nearest_to(frontiers, last.about)
        best = kept or min(frontiers, key=lambda f: f.time_s)
        return _over(best, routes, 1.0 / (1.0 + best.time_s))


class SemanticFrontier:
    """Frontier of highest value (VLFM, Yokoyama et al. 2024)."""

    def __init__(self, level_of: Mapping[str, float]) -> None:
        """Store l(O | C) of each common label as its value."""
        self._values = ValueMap(level_of)

    def observe(self, frame: Frame) -> None:
        """Update the value map."""
        self._values.observe(frame)

    def probabilities(self, probabilities: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return them unchanged; they count once no frontier is left."""
        return probabilities

    def choose(
        self, plan: Plan, routes: FloorRoutes, last: Aim | None, untried: Untried
    ) -> Aim | None:
        """See `Rule.choose`; a frontier is kept until another is clearly better."""
        del plan
        frontiers = [f for f in find_frontiers(routes) if untried(f.position)]
        if not frontiers:
            return None
        value = {f: self._values.value_near(*f.position) for f in frontiers}
        # The nearest of equal ones, such as those without a value yet.
        best = max(frontiers, key=lambda f: (value[f], -f.time_s))
        kept = None if last is None else _nearest_to(frontiers, last.about)
        # VLFM keeps its frontier unless its value has dropped by more than this.
        if kept is not None and last is not None and value[kept] + 0.01 >= last.worth:
            best = kept
        return _over(best, routes, value[best])


class GreedyNextBestView(WithoutSemantics):
    """Viewpoint with the highest discounted gain, without path gain or semantics.

    The gain of each viewpoint is the paper's with every level average. Gains along the path do not
    count, and distance discounts them as in Bircher et al. 2016, eq. (3).
    """

    def choose(
        self, plan: Plan, routes: FloorRoutes, last: Aim | None, untried: Untried
    ) -> Aim | None:
        """See `Rule.choose`; a viewpoint is kept until another is clearly better."""
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


def _nearest_to(frontiers: list[Frontier], about: tuple[float, float]) -> Frontier | None:
    """Return the frontier of a target, None if it has disappeared."""
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
