"""Looks at unseen floor straight ahead before the robot takes a detour around it."""

import math
from dataclasses import dataclass

from ippon.command import COMMAND_S, Command
from ippon.frame import FLOORS_APART_M
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.mission.behaviors.behavior import Action, StepContext
from ippon.mission.behaviors.config import FloorCheckConfig
from ippon.mission.snapshot import MissionState
from ippon.planning.plan import NodeKind, Plan
from ippon.robot import RobotProfile


@dataclass(slots=True)
class _Check:
    x_m: float
    y_m: float
    floor_z_m: float
    bearing_rad: float
    left_s: float
    """Seconds until it is abandoned: a robot without space to turn never faces the floor."""
    why: str = "looking at the floor ahead before taking a detour"
    held_s: float = 0.0


class FloorCheck:
    """Turns to the straight path to the target if only unseen floor blocks it."""

    def __init__(self, config: FloorCheckConfig, robot: RobotProfile) -> None:
        self._config = config
        self._robot = robot
        self._tilt = robot.within_tilt(config.tilt_rad)
        self._active: _Check | None = None
        self._earlier: list[_Check] = []
        self._goals: frozenset[int] = frozenset()
        """Numbers of the goals that these checks were made for."""

    def act(self, step: StepContext) -> Action | None:
        """See `Behavior.act`."""
        plan, frame = step.plan, step.frame
        goals = frozenset(search.goal.goal_id for search in step.searches)
        if not goals <= self._goals:
            # Another search: who stood in the way then may be gone.
            self._earlier.clear()
        self._goals |= goals
        command = self.step(plan, frame.T_world_base, frame.tilt_rad, step.dt_s)
        check = self._active
        if command is None or check is None:
            return None
        state = MissionState.APPROACHING if plan.ends_search else MissionState.SEARCHING
        return Action(command, state, check.why, heading_rad=check.bearing_rad)

    def step(
        self, plan: Plan, T_world_base: Float64Array, tilt_rad: float, dt_s: float
    ) -> Command | None:
        """Return the command of a check that is worth its time; None to follow the plan.

        Args:
            plan: The planner's plan on this frame.
            T_world_base: Pose of the robot.
            tilt_rad: Tilt of its camera.
            dt_s: Seconds since the last step.
        """
        at, yaw = T_world_base[:3, 3], yaw_of(T_world_base)
        check = self._active
        if check is not None and not self._is_at(check, at):
            check = None
        if check is None:
            check = self._on_path(plan, at, yaw, tilt_rad) or self._at_gap(plan, at, yaw)
            if check is not None and not plan.can_turn(wrap_angle(check.bearing_rad - yaw)):
                check = None
            if check is not None:
                self._earlier.append(check)
        self._active = check
        if check is None:
            return None
        # While frames are missing no image shows the floor.
        dt_s = min(dt_s, COMMAND_S)
        check.left_s -= dt_s
        error, tilt_off = wrap_angle(check.bearing_rad - yaw), abs(tilt_rad - self._tilt)
        config = self._config
        if abs(error) < config.facing_rad and tilt_off < config.tilt_tolerance_rad:
            check.held_s += dt_s
            error = 0.0
        if check.held_s >= config.hold_s or check.left_s <= 0.0:
            self._active = None
            return None
        fastest = self._robot.max_yaw_rate_rad_s
        rate = min(max(error / max(dt_s, 0.1), -fastest), fastest)
        return Command(yaw_rate_rad_s=rate, tilt_rad=self._tilt)

    def _on_path(self, plan: Plan, at: Float64Array, yaw: float, tilt_rad: float) -> _Check | None:
        """Return a check of the straight path to the target, where that may save enough time."""
        if plan.target is None or plan.unseen_shortcut_m <= 0.0:
            return None
        x, y, z = at.tolist()
        dx, dy = plan.target.position_world[0] - x, plan.target.position_world[1] - y
        bearing, robot = math.atan2(dy, dx), self._robot
        if self._was_checked(at, bearing):
            return None
        turn_s = abs(wrap_angle(bearing - yaw)) / robot.max_yaw_rate_rad_s
        tilt_s = abs(self._tilt - tilt_rad) / robot.max_tilt_rate_rad_s
        check_s = max(turn_s, tilt_s) + self._config.hold_s
        straight_s = math.hypot(dx, dy) / robot.max_linear_m_s
        if plan.target.path_cost_s < check_s + straight_s + self._config.min_saving_s:
            return None
        return _Check(x, y, z, bearing, 2.0 * check_s + 2.0)

    def _at_gap(self, plan: Plan, at: Float64Array, yaw: float) -> _Check | None:
        """Return a check of unseen floor that may lead to a room, unless an approach is planned."""
        target, gap = plan.target, plan.floor_gap
        ends = target is not None and target.kind is NodeKind.TERMINATING
        if gap is None or ends or plan.closer_look or plan.out_of_reach_m is not None:
            return None
        x, y, z = at.tolist()
        bearing = math.atan2(gap[1] - y, gap[0] - x)
        if self._was_checked(at, bearing):
            return None
        turn_s = abs(wrap_angle(bearing - yaw)) / self._robot.max_yaw_rate_rad_s
        left_s = 2.0 * (turn_s + self._config.hold_s) + 2.0
        return _Check(x, y, z, bearing, left_s, why="looking at the floor that may lead to a room")

    def _was_checked(self, at: Float64Array, bearing: float) -> bool:
        """Return whether an earlier check from here had about the same bearing."""
        seen_rad = self._config.seen_fraction * self._robot.horizontal_fov_rad
        return any(
            self._is_at(earlier, at) and abs(wrap_angle(bearing - earlier.bearing_rad)) < seen_rad
            for earlier in self._earlier
        )

    def _is_at(self, check: _Check, at: Float64Array) -> bool:
        """Return whether a check is from about the place (3,), on the same storey."""
        away = math.hypot(at[0] - check.x_m, at[1] - check.y_m)
        same_storey = abs(at[2] - check.floor_z_m) <= FLOORS_APART_M
        return same_storey and away < self._config.same_place_m
