"""Objects that are found but out of reach: on a sofa behind a table, behind glass, on a shelf.

The robot first tries detours over unseen floor. If there is none, it goes to the place nearest to
the object from which it is visible, and the search ends there.
"""

from dataclasses import dataclass, field

import numpy as np

from ippon.geometry import Float64Array
from ippon.planning.roadmap.shortest_tree import ShortestTree
from ippon.planning.selection.detours import (
    DetourConfig,
    Surroundings,
    find_detour,
    is_standable,
    nearest_viewing_position,
)
from ippon.planning.selection.interrupted_looks import INTERRUPTED_FACTOR, InterruptedLooks
from ippon.planning.selection.look_target import (
    LookConfig,
    LookTarget,
    is_same_cluster,
    look_at,
    stands_facing,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class OutOfReachConfig:
    """How long the robot tries before an object counts as out of reach."""

    around_steps: int = 300
    """Steps spent on detours over unseen floor, a minute at five per second, twice as many where
    another object interrupts them; more tries more of them."""
    patience_steps: int = 8
    """Steps that the robot looks at unseen floor before it counts as blocked; more allows for worse
    images."""
    sure_steps: int = 10
    """Steps without a detour after which there is none; more waits longer for new viewpoints."""
    approach_steps: int = 250
    """Steps on the way to the nearest place with a view of the object, after which the robot
    explores instead, twice as many where another object interrupts it; more drives longer to it."""
    reach_m: float = 0.95
    """Distance over the floor up to which an object is within reach, as in N_T; more ends the
    search farther from it."""
    detour: DetourConfig = field(default_factory=DetourConfig)

    def __post_init__(self) -> None:
        """Reject counts without meaning."""
        if min(self.around_steps, self.patience_steps, self.sure_steps, self.approach_steps) < 1:
            raise ValueError(
                "around_steps, patience_steps, sure_steps and approach_steps must be at least 1; "
                f"got {self.around_steps}, {self.patience_steps}, {self.sure_steps}, "
                f"{self.approach_steps}"
            )
        if not self.reach_m > 0.0:
            raise ValueError(f"reach_m must be above 0; got {self.reach_m}")


@dataclass(slots=True, kw_only=True)
class _Case:
    """One object that may be out of reach."""

    centre: Float64Array
    steps: int = 0
    sure: int = 0
    approach: int = 0
    closed: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    node: int | None = None
    settled: int = 0
    stand: tuple[Float64Array, Float64Array] | None = None
    steps_before: int = 0
    """Steps of interrupted tries."""
    approach_before: int = 0
    """Steps of interrupted ways to the nearest place."""


class OutOfReach:
    """Tries detours to an object, then leads to the nearest place from which it is visible."""

    def __init__(self, config: OutOfReachConfig, look: LookConfig, speed_m_s: float) -> None:
        self._config = config
        self._look = look
        self._speed = speed_m_s
        self._case: _Case | None = None
        self._interrupted = InterruptedLooks(look, 2)
        """Steps of tries and of ways. Two objects of nearly the same size take turns without end
        otherwise."""
        self._given_up: list[Float64Array] = []
        """Centre of each object whose nearest place the robot did not get to in time."""

    def reset(self) -> None:
        """Drop all cases, for another object."""
        self._case = None
        self._interrupted.clear()
        self._given_up.clear()

    def reopen(self) -> None:
        """Look for detours again: the margin of the floor was reduced."""
        if self._case is not None:
            self._case.sure, self._case.stand = 0, None

    def is_given_up(self, cluster: Float64Array) -> bool:
        """Return whether the robot explores in place of going on to an object, (M, 3) voxels."""
        centre = cluster.mean(axis=0)
        return any(is_same_cluster(self._look, old, centre) for old in self._given_up)

    def choose(
        self,
        cluster: Float64Array,
        around: Surroundings,
        tree: ShortestTree,
        xy: Float64Array,
        T_world_base: Float64Array,
        *,
        enough: float,
        cut_short: bool = False,
        counts: bool = True,
    ) -> LookTarget | None:
        """Return where to go for an object that no viewpoint ends the search at.

        Args:
            cluster: (M, 3) voxel centres, metres.
            around: Floor and map.
            tree: Shortest paths; it reaches at least one viewpoint.
            xy: (capacity, 2) positions of the viewpoints, metres.
            T_world_base: Pose of the robot.
            enough: Voxels that must be visible: T_min.
            cut_short: The step had no time for all new viewpoints and edges: it does not count as
                a step without a detour.
            counts: Whether it counts as a step of tries and ways.

        Returns:
            None while the case is undecided, or if the object is not visible well enough from any
            place.
        """
        case = self._case_of(cluster)
        case.steps += counts
        if case.stand is not None and not is_standable(around, case.stand[0]):
            case.stand = None
        robot = float(T_world_base[0, 3]), float(T_world_base[1, 3])
        around_steps, approach_steps = self._config.around_steps, self._config.approach_steps
        if case.stand is None and _lasts(case.steps, case.steps_before, around_steps):
            unknown = self._detour(case, cluster, around, robot)
            if unknown is not None:
                case.sure = 0
                return self._look_at_floor(case, unknown, around, tree, xy, T_world_base)
        case.sure += 0 if cut_short else 1
        if case.sure < self._config.sure_steps:
            return None
        if case.stand is None:
            found = nearest_viewing_position(
                self._config.detour, around, cluster, enough, self._look.sight_points
            )
            if found is None:
                case.sure = 0
                return None
            case.stand = found
        case.approach += counts
        if not _lasts(case.approach, case.approach_before, approach_steps):
            if not self.is_given_up(cluster):
                self._given_up.append(case.centre)
            return None
        place, voxel = case.stand
        node = int(tree.order[np.argmin(np.hypot(*(xy[tree.order] - place).T))])
        away = float(np.hypot(*(cluster[:, :2] - xy[node]).T).min())
        return look_at(node, xy[node], voxel, around.camera_z_m, away)

    def _detour(
        self,
        case: _Case,
        cluster: Float64Array,
        around: Surroundings,
        robot_xy: tuple[float, float],
    ) -> tuple[float, float] | None:
        """Return where unseen floor begins on a detour to the object; see `find_detour`."""
        return find_detour(
            self._config.detour,
            around,
            cluster,
            case.closed,
            self._config.reach_m,
            robot_xy,
            self._look.sight_points,
        )

    def wanted_place(self) -> Float64Array | None:
        """Return the place (2,) that needs a viewpoint, None for none."""
        return None if self._case is None or self._case.stand is None else self._case.stand[0]

    def _case_of(self, cluster: Float64Array) -> _Case:
        centre, case = cluster.mean(axis=0), self._case
        if case is None or not is_same_cluster(self._look, case.centre, centre):
            if case is not None:
                steps = case.steps_before + case.steps
                self._interrupted.add(case.centre, steps, case.approach_before + case.approach)
            steps, approach = self._interrupted.take(centre)
            case = _Case(centre=centre, steps_before=steps, approach_before=approach)
        case.centre = centre
        self._case = case
        return case

    def _look_at_floor(
        self,
        case: _Case,
        unknown: tuple[float, float],
        around: Surroundings,
        tree: ShortestTree,
        xy: Float64Array,
        T_world_base: Float64Array,
    ) -> LookTarget | None:
        """Look at unseen floor from the viewpoint that takes least time; later it is blocked."""
        nodes, floor_z = tree.order, float(T_world_base[2, 3])
        point = np.array([*unknown, floor_z + 0.5 * around.grid.voxel_size])
        away = np.hypot(*(xy[nodes] - point[:2]).T)
        seconds = tree.cost[nodes] + self._look.detour_factor * away / self._speed
        seconds[nodes == case.node] -= self._look.keep_s
        for row in np.argsort(seconds, kind="stable")[: self._look.max_viewpoints].tolist():
            node = int(nodes[row])
            if around.is_visible(xy[node], point):
                break
        else:
            case.closed.append(unknown)
            return None
        look = look_at(node, xy[node], point, around.camera_z_m)
        stays = node == case.node and stands_facing(
            self._look, T_world_base, xy[node], look.yaw_rad
        )
        case.settled = case.settled + 1 if stays else 0
        case.node = node
        if case.settled >= self._config.patience_steps:
            case.closed.append(unknown)
            case.settled = 0
        return look


def _lasts(steps: int, before: int, most: int) -> bool:
    """Return whether a try may go on after its steps and those of interrupted ones before it."""
    return steps <= most and before + steps <= INTERRUPTED_FACTOR * most
