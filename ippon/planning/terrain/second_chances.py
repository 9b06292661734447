"""When narrow gaps and the cells of contacts are opened, and when they are closed again."""

from ippon.geometry import Float64Array
from ippon.planning.terrain.traversability import Traversability


class SecondChances:
    """Opens narrow gaps and the cells of contacts before a search gives up, and for no longer.

    Without a search, narrow gaps alone are opened, for a point that no other path leads to: the
    robot may stand behind one.

    Args:
        floor: The floor.
        most: See `PlannerConfig.second_chances`.
    """

    def __init__(self, floor: Traversability, most: int) -> None:
        self._floor = floor
        self._most = most
        self._left = self._looks_left = most
        self._searching, self._counts = False, True
        self._point: tuple[float, float] | None = None
        """The point that narrow gaps were opened for, None for none."""

    def begin(self) -> None:
        """Close what was opened before another search."""
        self._searching, self._point = True, None
        self._left = self._looks_left = self._most
        self._floor.restore()

    def set_searching(self, searching: bool, *, counts: bool = True) -> None:
        """Close what was opened when a search ends, or goes on after its end.

        Args:
            searching: Whether a search runs.
            counts: Whether it may give up in the next step; nothing is opened for that otherwise.
        """
        self._counts = counts
        if searching != self._searching:
            self.begin()
            self._searching = searching

    def relax(self) -> bool:
        """Open both before a search gives up; return whether any was closed."""
        return self._counts and self._open()

    def _open(self) -> bool:
        if not self._searching or self._left == 0 or not self._floor.relax():
            return False
        self._left -= 1
        return True

    def relax_for_look(self) -> bool:
        """Open both before a look from out of reach; return whether any was closed.

        It takes a try in any case: what is closed later must not be opened in the same step.
        """
        if self._looks_left == 0:
            return False
        self._looks_left -= 1
        return self._open()

    def open_for(self, xy: Float64Array) -> bool:
        """Open narrow gaps for a point (2,), unless a search runs; return whether any was closed.

        Args:
            xy: World x and y, metres.
        """
        if self._searching:
            return False
        self._point = (float(xy[0]), float(xy[1]))
        return self._floor.squeeze()

    def close_for(self, xy: Float64Array) -> bool:
        """Close the narrow gaps of another point than (2,) `xy`; return whether any were open."""
        if self._point is None or self._point == (float(xy[0]), float(xy[1])):
            return False
        self._point = None
        self._floor.restore()
        return True
