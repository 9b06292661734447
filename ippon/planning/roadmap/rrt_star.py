"""RRT* from OMPL, set up for one pair of points on the floor (Sec. Node Connection)."""

import math
from typing import Any

from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from ippon.geometry import Float64Array
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.floor_grid import FloorGrid
from ippon.planning.terrain.motion_check import can_stand_at, straight_move


class FloorSpace:
    """The free space of the body for OMPL's callbacks.

    A class of its own because OMPL keeps its callbacks alive: a callback that referred to the query
    would keep the whole query alive as well.
    """

    def __init__(self, grid: FloorGrid, limits: BodyLimits, margin_m: float) -> None:
        self.grid = grid
        self._limits = limits
        self._margin_m = margin_m

    def move(self, ax: float, ay: float, bx: float, by: float) -> tuple[bool, float, float]:
        """Check a straight move; see `straight_move`."""
        return straight_move(self.grid, self._limits, ax, ay, bx, by, self._margin_m, math.inf)

    def stands(self, x: float, y: float) -> bool:
        """Return whether the body can stand and turn at a point."""
        return can_stand_at(self.grid, self._limits, float(x), float(y), self._margin_m)


class _Motion(ob.MotionValidator):
    """Checks a straight piece on the floor grid. Only the two-argument form is ever called."""

    def __init__(self, space_information: Any, move: Any) -> None:
        super().__init__(space_information)
        self._move = move

    def checkMotion(self, a: Any, b: Any, *_last: Any) -> bool:  # noqa: N802
        return self._move(a[0], a[1], b[0], b[1])[0]


class _LengthAndCrowding(ob.OptimizationObjective):
    """Path length plus the weighted integral of the inverse clearance."""

    def __init__(self, space_information: Any, move: Any, weight: float) -> None:
        super().__init__(space_information)
        self._move = move
        self._weight = weight

    def stateCost(self, state: Any) -> Any:  # noqa: ARG002, N802
        return ob.Cost(0.0)

    def motionCost(self, s1: Any, s2: Any) -> Any:  # noqa: N802
        free, _, crowding = self._move(s1[0], s1[1], s2[0], s2[1])
        length = math.hypot(s1[0] - s2[0], s1[1] - s2[1])
        return ob.Cost(length + self._weight * crowding if free else math.inf)

    def motionCostHeuristic(self, s1: Any, s2: Any) -> Any:  # noqa: N802
        return ob.Cost(math.hypot(s1[0] - s2[0], s1[1] - s2[1]))

    def isSymmetric(self) -> bool:  # noqa: N802
        return True


def rrt_star(
    space: FloorSpace,
    start: Float64Array,
    goal: Float64Array,
    *,
    clearance_weight: float,
    reach_m: float,
    range_m: float,
    seed: int,
) -> Any:
    """Return OMPL's `SimpleSetup` with RRT* between two points.

    Args:
        space: Where the body is free.
        start: (2,) metres.
        goal: (2,) metres.
        clearance_weight: Weight of the inverse clearance beside the length.
        reach_m: Samples lie in the bounding box of the two ends, grown by this on each side.
        range_m: Longest move that RRT* adds at once.
        seed: Above 0; the same seed gives the same path.
    """
    ou.noOutputHandler()
    ou.RNG.setSeed(seed)
    plane = ob.RealVectorStateSpace(2)
    bounds = ob.RealVectorBounds(2)
    for axis in range(2):
        bounds.setLow(axis, min(start[axis], goal[axis]) - reach_m)
        bounds.setHigh(axis, max(start[axis], goal[axis]) + reach_m)
    plane.setBounds(bounds)
    setup = og.SimpleSetup(plane)
    information = setup.getSpaceInformation()

    def valid(state: Any) -> bool:
        return space.stands(state[0], state[1])

    setup.setStateValidityChecker(valid)
    information.setMotionValidator(_Motion(information, space.move))
    setup.setOptimizationObjective(_LengthAndCrowding(information, space.move, clearance_weight))
    begin: Any = plane.allocState()
    end: Any = plane.allocState()
    begin[0], begin[1] = float(start[0]), float(start[1])
    end[0], end[1] = float(goal[0]), float(goal[1])
    setup.setStartAndGoalStates(begin, end, 0.5 * space.grid.voxel_size)
    planner = og.RRTstar(information)
    planner.setRange(range_m)
    setup.setPlanner(planner)
    return setup
