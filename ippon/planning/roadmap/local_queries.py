"""The queries to the local planner, one at a time, and when a failed one may be repeated."""

from typing import Final

from ippon.geometry import Float64Array
from ippon.planning.deadline import UNLIMITED, Deadline
from ippon.planning.roadmap.local_planner import LocalPlannerConfig, LocalQuery
from ippon.planning.terrain.traversability import Traversability

RETRY_STEPS: Final = 10
"""Changes of the floor after which what could not be joined may be tried again."""


class LocalQueries:
    """Looks for ways by OMPL; what there is no time left for goes on when it is asked for again."""

    def __init__(self, config: LocalPlannerConfig, floor: Traversability, seed: int) -> None:
        self._config = config
        self._floor = floor
        self._seed = seed
        self._query: LocalQuery | None = None
        self.begun = 0
        """Queries that were begun; each has another seed."""
        self.floor_changes = 0
        """How often the floor has changed."""

    @property
    def unfinished(self) -> bool:
        """The last query has no answer yet: it goes on with the next step."""
        return self._query is not None

    def note_floor_change(self) -> None:
        """Take note that the floor is another one than before."""
        self.floor_changes += 1

    def may_retry(self, floor_changes: int) -> bool:
        """Tell whether what failed after so many changes of the floor may be tried again."""
        return self.floor_changes - floor_changes >= RETRY_STEPS

    def solve(
        self, start: Float64Array, goal: Float64Array, deadline: Deadline = UNLIMITED
    ) -> Float64Array | None:
        """Find a way between two points.

        Args:
            start: (2,) metres.
            goal: (2,) metres.
            deadline: Ends the looking for this time.

        Returns:
            (K, 2) points from start to goal, metres. None where there is no way, where the local
            planner is switched off, or where finding one has to go on: `unfinished`.
        """
        if not self._config.enabled:
            return None
        grid, query = self._floor.grid, self._query
        if query is None or not query.joins(start, goal):
            self.begun += 1
            query = LocalQuery(
                self._config,
                grid,
                self._floor.limits,
                start,
                goal,
                margin=self._floor.margin_m,
                seed=1 + (self._seed * 7919 + self.begun) % 2_000_000_000,
            )
        self._query = None if query.solve(grid, deadline) else query
        path = query.path()
        if path is not None:
            path[0] = start
        return path
