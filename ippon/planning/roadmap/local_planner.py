"""A way between two viewpoints where the straight line is blocked (Sec. Node Connection)."""

import math
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from ippon.geometry import Float64Array
from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.clearance import FloorGrid, can_stand, straight_move

LEAST_ITERATIONS: Final = 25
"""However late it is, a query goes on by so many in a step: 3 ms."""
SAME_PLACE_M: Final = 0.05
"""A robot that is this near to where it stood stands there still."""

_RANGE_M: Final = 0.8
"""Longest move that RRT* adds at once."""
_LONG_RANGE_M: Final = 2.0
"""The same for a body that turns only at the ends of a move, and passes what is narrow between."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalPlannerConfig:
    """The sampling-based planner from OMPL, and what it minimises."""

    enabled: bool = True
    """Off in the ablation "w/o Local SBP": nodes connect by straight lines or not at all."""
    clearance: Literal["soft", "hard"] = "soft"
    """`soft` penalises length by inverse clearance; `hard` forbids less than `hard_margin_m`."""
    clearance_weight: float = 0.15
    """Weight of inverse clearance; more makes longer ways through the middle of rooms."""
    hard_margin_m: float = 0.15
    """Room beside the body that `hard` demands."""
    iterations: int = 400
    """Iterations of RRT* a query; more finds narrower ways and takes longer."""
    reach_m: float = 1.5
    """Samples lie in the box of the two ends, this much wider on each side."""

    def __post_init__(self) -> None:
        """Reject a budget that finds nothing."""
        if self.iterations < 10:
            raise ValueError(f"iterations must be at least 10; got {self.iterations}")


class _Motion(ob.MotionValidator):
    """Checks a straight piece on the floor grid. Only the two-argument form is ever called."""

    def __init__(self, space_information: Any, query: Any) -> None:
        super().__init__(space_information)
        self._query = query

    def checkMotion(self, a: Any, b: Any, *_last: Any) -> bool:  # noqa: N802
        return self._query(a[0], a[1], b[0], b[1])[0]


class _LengthAndCrowding(ob.OptimizationObjective):
    """Length, penalised by the inverse of the clearance along the way."""

    def __init__(self, space_information: Any, query: Any, weight: float) -> None:
        super().__init__(space_information)
        self._query = query
        self._weight = weight

    def stateCost(self, state: Any) -> Any:  # noqa: ARG002, N802
        return ob.Cost(0.0)

    def motionCost(self, s1: Any, s2: Any) -> Any:  # noqa: N802
        free, _, crowding = self._query(s1[0], s1[1], s2[0], s2[1])
        length = math.hypot(s1[0] - s2[0], s1[1] - s2[1])
        return ob.Cost(length + self._weight * crowding if free else math.inf)

    def motionCostHeuristic(self, s1: Any, s2: Any) -> Any:  # noqa: N802
        return ob.Cost(math.hypot(s1[0] - s2[0], s1[1] - s2[1]))

    def isSymmetric(self) -> bool:  # noqa: N802
        return True


class _Floor:
    """What a query goes over. Apart from it: OMPL holds on to what asks, and would to the query."""

    def __init__(self, grid: FloorGrid, limits: BodyLimits, margin: float) -> None:
        self.grid = grid
        self.range_m = _LONG_RANGE_M if len(limits.discs) else _RANGE_M
        self._limits = limits
        self._margin = margin

    def move(self, ax: float, ay: float, bx: float, by: float) -> tuple[bool, float, float]:
        return straight_move(self.grid, self._limits, ax, ay, bx, by, self._margin, math.inf)

    def stands(self, x: float, y: float) -> bool:
        return can_stand(self.grid, self._limits, np.array([x, y]), self._margin)


class LocalQuery:
    """Looks for a way round what blocks the straight line, at once or bit by bit.

    OMPL holds the GIL while it solves and would burn its whole budget on an invalid goal, so ends
    are checked first, and the budget is a count of iterations: without a deadline the same query
    gives the same way on any machine.
    """

    def __init__(
        self,
        config: LocalPlannerConfig,
        grid: FloorGrid,
        limits: BodyLimits,
        start: Float64Array,
        goal: Float64Array,
        *,
        margin: float,
        seed: int,
    ) -> None:
        """Prepare.

        Args:
            config: Budget and objective.
            grid: The floor.
            limits: The body.
            start: (2,) metres.
            goal: (2,) metres.
            margin: Room that every move must leave beside the body, metres.
            seed: Above 0; the same seed gives the same way.
        """
        if config.clearance == "hard":
            margin = max(margin, config.hard_margin_m)
        self._start, self._goal = start.copy(), goal.copy()
        self._iterations = config.iterations
        self._calls = 0
        self._floor = _Floor(grid, limits, margin)
        ends_stand = self._floor.stands(*start) and self._floor.stands(*goal)
        self._setup = _set_up(config, self._floor, start, goal, seed) if ends_stand else None

    def joins(self, start: Float64Array, goal: Float64Array) -> bool:
        """Tell whether this is the query between two points (2,)."""
        same_start = math.dist(self._start, start) <= SAME_PLACE_M
        return same_start and math.dist(self._goal, goal) == 0.0

    def solve(self, grid: FloorGrid, deadline: Deadline = UNLIMITED) -> bool:
        """Look for a way, or look on.

        Args:
            grid: The floor as it is now; what was looked at before is not looked at again.
            deadline: Ends the looking for this time, after `LEAST_ITERATIONS`.

        Returns:
            Whether the answer is there: a way, or that the iterations found none.
        """
        if self._setup is None:
            return True
        self._floor.grid = grid
        least = self._calls + LEAST_ITERATIONS

        def spent() -> bool:
            self._calls += 1
            if self._calls > self._iterations:
                return True
            return self._calls > least and deadline.passed()

        self._setup.solve(ob.PlannerTerminationCondition(spent))
        return self._calls > self._iterations or self._setup.haveExactSolutionPath()

    def path(self) -> Float64Array | None:
        """Return the (K, 2) points from start to goal; None where no way was found."""
        if self._setup is None or not self._setup.haveExactSolutionPath():
            return None
        states: Any = self._setup.getSolutionPath()
        points = [states.getState(n)[0:2] for n in range(states.getStateCount())]
        # The goal counts as reached within half a voxel; end exactly on the node.
        points[-1] = [float(self._goal[0]), float(self._goal[1])]
        return np.array(points, dtype=np.float64)


def _set_up(
    config: LocalPlannerConfig, floor: _Floor, start: Float64Array, goal: Float64Array, seed: int
) -> Any:
    """Return OMPL's RRT* between two points (2,)."""
    ou.noOutputHandler()
    ou.RNG.setSeed(seed)
    space = ob.RealVectorStateSpace(2)
    bounds = ob.RealVectorBounds(2)
    for axis in range(2):
        bounds.setLow(axis, min(start[axis], goal[axis]) - config.reach_m)
        bounds.setHigh(axis, max(start[axis], goal[axis]) + config.reach_m)
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    information = setup.getSpaceInformation()

    def valid(state: Any) -> bool:
        return floor.stands(state[0], state[1])

    setup.setStateValidityChecker(valid)
    information.setMotionValidator(_Motion(information, floor.move))
    weight = config.clearance_weight if config.clearance == "soft" else 0.0
    setup.setOptimizationObjective(_LengthAndCrowding(information, floor.move, weight))
    begin: Any = space.allocState()
    end: Any = space.allocState()
    begin[0], begin[1] = float(start[0]), float(start[1])
    end[0], end[1] = float(goal[0]), float(goal[1])
    setup.setStartAndGoalStates(begin, end, 0.5 * floor.grid.voxel_size)
    planner = og.RRTstar(information)
    planner.setRange(floor.range_m)
    setup.setPlanner(planner)
    return setup
