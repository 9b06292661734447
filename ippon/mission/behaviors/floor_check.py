"""A look at the floor straight ahead, before a way round it is taken."""

import math
from dataclasses import dataclass
from typing import Final

from ippon.command import Command
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.planning.plan import NodeKind, Plan
from ippon.robot import RobotProfile

_SAME_PLACE_M: Final = 0.4
_FACING_RAD: Final = 0.1
_TILT_RAD: Final = 0.06
_SEEN_SHARE: Final = 0.4
"""Of the field of view, to either side of where a look went: that floor need not be looked at."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GlanceConfig:
    """When the robot looks at the floor between itself and where it is going."""

    min_saving_s: float = 2.0
    """The straight way must save so much more time than the look costs; more looks less often."""
    tilt_rad: float = -0.7
    """Lower sees closer floor and less far."""
    hold_s: float = 0.6
    """So long the camera rests on the floor; more takes more images of it."""

    def __post_init__(self) -> None:
        """Reject times that would look for ever, or at once."""
        if self.min_saving_s < 0.0 or not 0.0 < self.hold_s <= 10.0:
            raise ValueError(
                f"min_saving_s must not be negative and hold_s above 0, at most 10; got "
                f"{self.min_saving_s}, {self.hold_s}"
            )


@dataclass(slots=True)
class _Look:
    x_m: float
    y_m: float
    bearing_rad: float
    left_s: float
    """It is given up after so long: where there is no room to turn, the robot is not let turn."""
    why: str = "looking at the floor ahead, before a way round it"
    held_s: float = 0.0


class Glance:
    """Looks along the straight way to the target where only unseen floor is known to be on it."""

    def __init__(self, config: GlanceConfig, robot: RobotProfile) -> None:
        self._config = config
        self._robot = robot
        self._tilt = robot.within_tilt(config.tilt_rad)
        self._look: _Look | None = None
        self._looked: list[_Look] = []

    @property
    def why(self) -> str:
        """What the robot looks at, for the operator; empty without a look."""
        return "" if self._look is None else self._look.why

    def step(
        self, plan: Plan, T_world_base: Float64Array, tilt_rad: float, dt_s: float
    ) -> Command | None:
        """Return the command of a look that is worth its time; None to go on with the plan.

        Args:
            plan: What the planner chose on this frame.
            T_world_base: Where the robot stands.
            tilt_rad: Its camera's tilt.
            dt_s: Seconds since the step before.
        """
        x, y, yaw = float(T_world_base[0, 3]), float(T_world_base[1, 3]), yaw_of(T_world_base)
        look = self._look
        if look is not None and math.hypot(x - look.x_m, y - look.y_m) > _SAME_PLACE_M:
            look = None
        if look is None:
            look = self._worth_a_look(plan, x, y, yaw, tilt_rad) or self._at_gap(plan, x, y, yaw)
            if look is not None:
                self._looked.append(look)
        self._look = look
        if look is None:
            return None
        look.left_s -= dt_s
        error = wrap_angle(look.bearing_rad - yaw)
        if abs(error) < _FACING_RAD and abs(tilt_rad - self._tilt) < _TILT_RAD:
            look.held_s += dt_s
            error = 0.0
        if look.held_s >= self._config.hold_s or look.left_s <= 0.0:
            self._look = None
            return None
        fastest = self._robot.max_yaw_rate_rad_s
        rate = min(max(error / max(dt_s, 0.1), -fastest), fastest)
        return Command(yaw_rate_rad_s=rate, tilt_rad=self._tilt)

    def _worth_a_look(
        self, plan: Plan, x: float, y: float, yaw: float, tilt_rad: float
    ) -> _Look | None:
        if plan.target is None or plan.unseen_straight_m <= 0.0:
            return None
        dx, dy = plan.target.position_world[0] - x, plan.target.position_world[1] - y
        bearing, robot = math.atan2(dy, dx), self._robot
        if self._has_looked(x, y, bearing):
            return None
        turn_s = abs(wrap_angle(bearing - yaw)) / robot.max_yaw_rate_rad_s
        tilt_s = abs(self._tilt - tilt_rad) / robot.max_tilt_rate_rad_s
        look_s = max(turn_s, tilt_s) + self._config.hold_s
        straight_s = math.hypot(dx, dy) / robot.max_linear_m_s
        if plan.target.path_cost_s < look_s + straight_s + self._config.min_saving_s:
            return None
        return _Look(x, y, bearing, 2.0 * look_s + 2.0)

    def _at_gap(self, plan: Plan, x: float, y: float, yaw: float) -> _Look | None:
        """Look at floor that may lead to a room, unless the robot has something better to do."""
        target, gap = plan.target, plan.floor_gap
        ends = target is not None and target.kind is NodeKind.TERMINATING
        if gap is None or ends or plan.closer_look or plan.out_of_reach_m is not None:
            return None
        bearing = math.atan2(gap[1] - y, gap[0] - x)
        if self._has_looked(x, y, bearing):
            return None
        turn_s = abs(wrap_angle(bearing - yaw)) / self._robot.max_yaw_rate_rad_s
        left_s = 2.0 * (turn_s + self._config.hold_s) + 2.0
        return _Look(x, y, bearing, left_s, why="looking at the floor that may lead to a room")

    def _has_looked(self, x: float, y: float, bearing: float) -> bool:
        """Tell whether a look from here went that way before."""
        return any(
            math.hypot(x - before.x_m, y - before.y_m) < _SAME_PLACE_M
            and abs(wrap_angle(bearing - before.bearing_rad))
            < _SEEN_SHARE * self._robot.horizontal_fov_rad
            for before in self._looked
        )
