"""The local planner: a path between two points where the straight line is blocked.

See Sec. Node Connection. One query runs at a time; `LocalPlanner` resumes a query that ran out of
time and counts the changes of the floor after which a failed one may be repeated.
"""

import math
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from ompl import base as ob

from ippon.geometry import Float64Array
from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.roadmap.rrt_star import FloorSpace, rrt_star
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.floor_grid import FloorGrid
from ippon.planning.terrain.traversability import Traversability

SAME_PLACE_M: Final = 0.05
"""Two positions of the robot that are no farther apart than this count as one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalPlannerConfig:
    """The sampling-based planner from OMPL, and what it minimises."""

    enabled: bool = True
    """Off in the ablation "w/o Local SBP": nodes connect by straight lines or not at all."""
    clearance: Literal["soft", "hard"] = "soft"
    """`soft` penalises length by inverse clearance; `hard` forbids less than `hard_margin_m`."""
    clearance_weight: float = 0.15
    """Weight of the inverse clearance; more makes longer paths through the middle of rooms."""
    hard_margin_m: float = 0.15
    """Free space beside the body that `hard` demands."""
    iterations: int = 400
    """Iterations of RRT* per query; more finds narrower paths and takes longer."""
    min_iterations_per_step: int = 25
    """Iterations that a query runs in a step after the deadline has passed; more finishes sooner
    and delays the step."""
    reach_m: float = 1.5
    """Samples lie in the bounding box of the two ends, grown by this on each side; more finds
    longer detours and samples more sparsely."""
    range_m: float = 0.8
    """Longest move that RRT* adds at once; more crosses open space in fewer iterations."""
    long_body_range_m: float = 2.0
    """The same for a long body, which turns only at the ends of a move and needs long straight
    moves through narrow passages."""
    retry_after_changes: int = 10
    """Changes of the floor after which a failed query may be repeated; more repeats less often."""

    def __post_init__(self) -> None:
        """Reject budgets that find nothing."""
        if self.iterations < 10:
            raise ValueError(f"iterations must be at least 10; got {self.iterations}")
        if self.min_iterations_per_step < 1 or self.retry_after_changes < 1:
            raise ValueError(
                "min_iterations_per_step and retry_after_changes must be at least 1; got "
                f"{self.min_iterations_per_step} and {self.retry_after_changes}"
            )
        if min(self.range_m, self.long_body_range_m) <= 0.0:
            raise ValueError("range_m and long_body_range_m must be above 0")


class LocalQuery:
    """The search for a path between two points, solved at once or in pieces.

    OMPL holds the GIL while it solves and spends its whole budget on an invalid goal, so both ends
    are checked first. The budget is a number of iterations: without a deadline the same query gives
    the same path on any machine.
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
        """Prepare the query.

        Args:
            config: Budget and objective.
            grid: The floor.
            limits: The body.
            start: (2,) metres.
            goal: (2,) metres.
            margin: Free space beside the body that every move must leave, metres.
            seed: Above 0; the same seed gives the same path.
        """
        self._config = config
        self._start, self._goal = start.copy(), goal.copy()
        self._margin_m = margin
        self._calls = 0
        if config.clearance == "hard":
            margin = max(margin, config.hard_margin_m)
        self._space = FloorSpace(grid, limits, margin)
        self._setup: Any = None
        if self._space.stands(*start) and self._space.stands(*goal):
            self._setup = rrt_star(
                self._space,
                start,
                goal,
                clearance_weight=config.clearance_weight if config.clearance == "soft" else 0.0,
                reach_m=config.reach_m,
                range_m=config.long_body_range_m if len(limits.discs) else config.range_m,
                seed=seed,
            )

    def joins(self, start: Float64Array, goal: Float64Array, margin: float) -> bool:
        """Return whether this is the query between two points (2,) with a margin."""
        same_start = math.dist(self._start, start) <= SAME_PLACE_M
        return same_start and math.dist(self._goal, goal) == 0.0 and margin == self._margin_m

    def solve(self, grid: FloorGrid, deadline: Deadline = UNLIMITED) -> bool:
        """Start or resume the search.

        Args:
            grid: The floor as it is now; moves that RRT* has checked already are not rechecked.
            deadline: Ends this call, after `min_iterations_per_step`.

        Returns:
            Whether the query is finished: with a path, or with all iterations used.
        """
        if self._setup is None:
            return True
        config = self._config
        self._space.grid = grid
        least = self._calls + config.min_iterations_per_step

        def spent() -> bool:
            self._calls += 1
            if self._calls > config.iterations:
                return True
            return self._calls > least and deadline.passed()

        self._setup.solve(ob.PlannerTerminationCondition(spent))
        return self._calls > config.iterations or self._setup.haveExactSolutionPath()

    def path(self) -> Float64Array | None:
        """Return the (K, 2) points from start to goal, metres; None if no path was found."""
        if self._setup is None or not self._setup.haveExactSolutionPath():
            return None
        states: Any = self._setup.getSolutionPath()
        points = [states.getState(n)[0:2] for n in range(states.getStateCount())]
        # The goal counts as reached within half a voxel; end exactly on the node.
        points[-1] = [float(self._goal[0]), float(self._goal[1])]
        return np.array(points, dtype=np.float64)


class LocalPlanner:
    """Solves one query after another, and resumes a query that ran out of time."""

    def __init__(self, config: LocalPlannerConfig, floor: Traversability, seed: int) -> None:
        self._config = config
        self._floor = floor
        self._seed = seed
        self._query: LocalQuery | None = None
        self.begun = 0
        """Number of queries that were begun; each has its own seed."""
        self.floor_changes = 0
        """Number of changes of the floor so far."""

    @property
    def unfinished(self) -> bool:
        """The last query ran out of time and continues with the next step."""
        return self._query is not None

    def note_floor_change(self) -> None:
        """Count a change of the floor."""
        self.floor_changes += 1

    def may_retry(self, floor_changes: int) -> bool:
        """Return whether a query that failed at this count of floor changes may be repeated."""
        return self.floor_changes - floor_changes >= self._config.retry_after_changes

    def solve(
        self, start: Float64Array, goal: Float64Array, deadline: Deadline = UNLIMITED
    ) -> Float64Array | None:
        """Find a path between two points.

        Args:
            start: (2,) metres.
            goal: (2,) metres.
            deadline: Ends this call.

        Returns:
            (K, 2) points from start to goal, metres. None if there is no path, if the local
            planner is switched off, or if the query ran out of time: see `unfinished`.
        """
        if not self._config.enabled:
            return None
        grid, margin, query = self._floor.grid, self._floor.margin_m, self._query
        if query is None or not query.joins(start, goal, margin):
            self.begun += 1
            query = LocalQuery(
                self._config,
                grid,
                self._floor.limits,
                start,
                goal,
                margin=margin,
                seed=1 + (self._seed * 7919 + self.begun) % 2_000_000_000,
            )
        self._query = None if query.solve(grid, deadline) else query
        path = query.path()
        if path is not None:
            path[0] = start
        return path
