"""Goals for a robot that navigates by itself, in place of velocities along a path."""

import math
from dataclasses import dataclass

from ippon.command import COMMAND_S, Command, GoalOutcome, NavigationGoal
from ippon.control.tilt_wait import TiltWait
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.planning.plan import NodeKind, Plan
from ippon.robot import RobotProfile

_Place = tuple[float, float, float]
"""World x and y in metres, and heading in radians."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalFollowerConfig:
    """When a goal is replaced, and when it counts as reached or failed."""

    moved_m: float = 0.25
    """Distance of a target from the present goal above which it becomes a new goal; more sends
    fewer goals and stops farther from the viewpoint."""
    turned_rad: float = 0.26
    """The same for its heading; more sends fewer goals and looks less exactly."""
    min_period_s: float = 1.0
    """Least time between two goals while the first is driven to; more interrupts the robot less."""
    near_m: float = 0.35
    """Distance at which a robot that stands counts as arrived; more accepts a less exact robot."""
    near_rad: float = 0.35
    """The same for its heading."""
    stands_s: float = 2.0
    """Time without motion near the goal after which the robot has arrived, where it does not say
    so; more waits longer."""
    stuck_s: float = 30.0
    """Time without motion far from the goal after which it counts as failed; more leaves the
    robot's own recovery more time."""
    silent_s: float = 5.0
    """Time without an answer of the robot after which the operator is told; more warns later."""
    retry_s: float = 10.0
    """Time after which a failed goal that is still wanted is sent again; more retries less."""
    motion_m: float = 0.05
    """Displacement that counts as motion."""
    motion_rad: float = 0.1
    """Turn that counts as motion."""
    turn_ahead_rad: float = 1.9
    """Angle by which the goals of a turn on the spot lead the robot; more turns with fewer goals;
    above pi the robot would turn the other way."""

    def __post_init__(self) -> None:
        """Reject limits that would flood the robot with goals or never settle."""
        if not (self.moved_m > 0.0 and self.turned_rad > 0.0 and self.min_period_s >= 0.2):
            raise ValueError(
                "moved_m and turned_rad must be positive and min_period_s at least 0.2; got "
                f"{self.moved_m}, {self.turned_rad}, {self.min_period_s}"
            )
        if not (self.near_m > 0.0 and self.near_rad > 0.0 and self.stuck_s > self.stands_s > 0.0):
            raise ValueError(
                "near_m, near_rad and stands_s must be positive, and stuck_s above stands_s; got "
                f"{self.near_m}, {self.near_rad}, {self.stands_s}, {self.stuck_s}"
            )
        if not 0.5 <= self.turn_ahead_rad <= 3.0:
            raise ValueError(f"turn_ahead_rad lies in 0.5 to 3; got {self.turn_ahead_rad}")


class GoalFollower:
    """Turns the planner's targets into goals, and follows what the robot says about them.

    Args:
        config: Limits.
        robot: Tilt range of its camera.
        angle_tolerance_rad: Of the camera's tilt at the target.
    """

    def __init__(
        self, config: GoalFollowerConfig, robot: RobotProfile, angle_tolerance_rad: float
    ) -> None:
        self.config = config
        self._robot = robot
        self._tilt_tolerance = angle_tolerance_rad
        self._tilt_wait = TiltWait(robot)
        self._goal: NavigationGoal | None = None
        self._outcome: GoalOutcome | None = None
        self._numbers = 0
        self._turn_number = 0
        self._age_s = self._still_s = 0.0
        self._still_at = (0.0, 0.0, 0.0)
        self._reached_at: _Place | None = None
        """Where the robot was when it had reached the goal."""
        self._seen_at: _Place | None = None
        """Where it was at the last step that aimed."""
        self._moved = False
        self._reached = False
        self._failed: NavigationGoal | None = None

    def resume_from(self, command: Command) -> None:
        """Do nothing: goals have no acceleration. See `PathFollower.resume_from`."""

    @property
    def reached(self) -> bool:
        """The robot has arrived at the last step's target, and its camera has the tilt.

        A tilt that does not come is not awaited without end; see `TiltWait`.
        """
        return self._reached

    @property
    def is_silent(self) -> bool:
        """The robot has neither answered the goal nor moved."""
        unheard = self._goal is not None and self._outcome is None and not self._moved
        return unheard and self._age_s > self.config.silent_s

    def report(self, number: int, outcome: GoalOutcome) -> None:
        """Take what the robot's navigation says about a goal; an earlier goal's is ignored."""
        ended = self._outcome in (GoalOutcome.REACHED, GoalOutcome.FAILED)
        if self._goal is None or number != self._goal.number or ended:
            return
        if outcome is GoalOutcome.CANCELLED:
            # By somebody else: it is sent again while it is wanted.
            self.forget_goal()
            return
        self._outcome = outcome
        if outcome is GoalOutcome.FAILED:
            self._fail()

    def forget_goal(self) -> None:
        """Forget the present goal: the next target is sent at once, also where it is the same."""
        self._goal = self._outcome = None

    def take_failed(self) -> NavigationGoal | None:
        """Return a goal that has failed since the last call, once."""
        failed, self._failed = self._failed, None
        return failed

    def step(
        self,
        plan: Plan,
        T_world_base: Float64Array,
        tilt_rad: float,
        map_arrays: MapArrays,
        dt_s: float,
    ) -> Command:
        """Return the command with the goal of a plan; see `PathFollower.step`."""
        del map_arrays
        self._reached = False
        if plan.target is None or len(plan.path_world) == 0:
            return Command(tilt_rad=tilt_rad)
        x, y, _ = plan.target.position_world
        yaw = plan.target.yaw_rad
        if plan.target.kind is NodeKind.MINIMAL and self._goal is not None:
            yaw = self._goal.yaw_rad  # It only faces the direction of travel.
        self._aim(x, y, yaw, T_world_base, dt_s)
        tilt = self._robot.within_tilt(plan.target.tilt_rad)
        if self._outcome is GoalOutcome.REACHED:
            self._reached = self._tilt_wait.is_over(tilt - tilt_rad, self._tilt_tolerance, dt_s)
        else:
            self._tilt_wait.restart()
        return Command(tilt_rad=tilt, goal=self._wanted())

    def turn(
        self, heading_rad: float, T_world_base: Float64Array, tilt_rad: float, dt_s: float
    ) -> Command:
        """Return the command that turns the robot on the spot.

        Args:
            heading_rad: World heading to turn to; one that is kept ahead of the robot turns on.
            T_world_base: Pose of the robot.
            tilt_rad: Wanted tilt of the camera.
            dt_s: Seconds since the last step.
        """
        x, y = float(T_world_base[0, 3]), float(T_world_base[1, 3])
        goal = self._goal
        if goal is not None and math.hypot(goal.x_m - x, goal.y_m - y) <= self.config.near_m:
            x, y = goal.x_m, goal.y_m
            ahead = wrap_angle(goal.yaw_rad - yaw_of(T_world_base))
            wanted = wrap_angle(heading_rad - yaw_of(T_world_base))
            if ahead * wanted > 0.0 and 0.4 * abs(wanted) < abs(ahead) < 1.2 * abs(wanted):
                heading_rad = goal.yaw_rad
        self._aim(x, y, heading_rad, T_world_base, dt_s)
        self._turn_number = self._numbers
        return Command(tilt_rad=tilt_rad, goal=self._wanted())

    def is_turn(self, goal: NavigationGoal) -> bool:
        """Return whether a goal was to turn the robot on the spot."""
        return goal.number == self._turn_number

    def _wanted(self) -> NavigationGoal | None:
        """Return the goal while the robot is on its way to it."""
        return self._goal if self._outcome in (None, GoalOutcome.ACCEPTED) else None

    def _aim(self, x: float, y: float, yaw: float, T_world_base: Float64Array, dt_s: float) -> None:
        """Keep the present goal, or replace it where the target has moved beyond the limits."""
        self._age_s += dt_s
        goal, config, place = self._goal, self.config, _place(T_world_base)
        if goal is not None and self._outcome is GoalOutcome.REACHED and self._reached_at is None:
            # Elsewhere it may have been moved since, where a pause followed at once.
            is_there = self._seen_at is None or self._is_near(_aim_of(goal), place)
            self._reached_at = place if is_there else self._seen_at
        self._seen_at = place
        if goal is None or not self._keeps(goal, (x, y, yaw), place):
            self._numbers += 1
            self._goal = NavigationGoal(number=self._numbers, x_m=x, y_m=y, yaw_rad=yaw)
            self._outcome = None
            self._age_s = self._still_s = 0.0
            self._moved = False
            self._still_at, self._reached_at = place, None
            return
        if self._outcome not in (None, GoalOutcome.ACCEPTED):
            return
        self._watch_motion(place, dt_s)
        if self._is_near(_aim_of(goal), place) and self._still_s >= config.stands_s:
            self._outcome, self._reached_at = GoalOutcome.REACHED, place
        elif self._still_s >= config.stuck_s and not self.is_silent:
            self._outcome = GoalOutcome.FAILED
            self._fail()

    def _keeps(self, goal: NavigationGoal, target: _Place, place: _Place) -> bool:
        config = self.config
        same = _are_near(_aim_of(goal), target, config.moved_m, config.turned_rad)
        if self._outcome is GoalOutcome.FAILED:
            return same and self._age_s < config.retry_s
        if self._outcome is GoalOutcome.REACHED:
            return same and self._is_still_there(goal, place)
        return same or self._age_s < config.min_period_s

    def _is_still_there(self, goal: NavigationGoal, place: _Place) -> bool:
        """Return whether the robot is at the goal, or where it was when it had reached it.

        That may be farther from the goal than `near_m`: the robot's navigation decides. Each time
        that it has reached a goal counts anew, so that an error of the pose sends no goal again.
        """
        reached_at = self._reached_at or place
        return self._is_near(reached_at, place) or self._is_near(_aim_of(goal), place)

    def _is_near(self, one: _Place, other: _Place) -> bool:
        return _are_near(one, other, self.config.near_m, self.config.near_rad)

    def _watch_motion(self, place: _Place, dt_s: float) -> None:
        config = self.config
        if _are_near(place, self._still_at, config.motion_m, config.motion_rad):
            # While frames are missing nobody sees whether it moves, and without commands it stands.
            self._still_s += min(dt_s, COMMAND_S)
        else:
            self._still_at, self._still_s, self._moved = place, 0.0, True

    def _fail(self) -> None:
        self._failed = self._goal
        self._age_s = 0.0


def _place(T_world_base: Float64Array) -> _Place:
    return float(T_world_base[0, 3]), float(T_world_base[1, 3]), yaw_of(T_world_base)


def _aim_of(goal: NavigationGoal) -> _Place:
    return goal.x_m, goal.y_m, goal.yaw_rad


def _are_near(one: _Place, other: _Place, within_m: float, within_rad: float) -> bool:
    (x, y, yaw), (other_x, other_y, other_yaw) = one, other
    is_close = math.hypot(x - other_x, y - other_y) <= within_m
    return is_close and abs(wrap_angle(yaw - other_yaw)) <= within_rad
