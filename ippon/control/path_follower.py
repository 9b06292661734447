"""Path tracking within the robot's limits, with a stop before obstacles that appear on the path."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ippon.command import Command
from ippon.control.acceleration_limits import limit_acceleration
from ippon.control.obstacles import OVERLAP_TOLERANCE_M, disc_clearance, hazards_around
from ippon.control.tilt_wait import TiltWait
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.planning.plan import Plan, Viewpoint
from ippon.planning.roadmap.robot_path import AT_NODE_M
from ippon.planning.terrain.path_geometry import point_along, poses_along, remaining_path
from ippon.robot import RobotProfile

_TURN_STEP_RAD: Final = 0.1
"""Step between the headings of a turn that are checked for collisions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowerConfig:
    """Path tracking: lookahead, tolerances, and speed near obstacles."""

    lookahead_m: float = 0.35
    """Distance along the path to the steering point; more is smoother and cuts corners."""
    turn_in_place_rad: float = 0.6
    """Heading error above which the robot stops and turns in place; more turns while driving."""
    go_on_rad: float = 0.25
    """Heading error below which it drives on after a turn in place; more drives on earlier."""
    position_tolerance_m: float = 0.08
    """Distance at which the target counts as reached; less takes longer to settle."""
    angle_tolerance_rad: float = 0.08
    """Tolerance of the final yaw and tilt; less takes longer to settle."""
    slow_clearance_m: float = 0.25
    """Free space beside the body below which the robot slows down; more drives more slowly."""
    slow_fraction: float = 0.4
    """Fraction of the top speed that remains when an obstacle almost touches the body."""
    braking_share: float = 0.6
    """Share of the maximum deceleration that is used for planning; less brakes earlier."""
    overlap_m: float = 0.05
    """The path counts as blocked where an obstacle voxel's centre lies this far inside the body;
    more tolerates errors of the map."""
    stop_margin_m: float = 0.05
    """Distance kept from an obstacle on the path; more stops earlier."""
    side_margin_m: float = 0.1
    """Free space beside the body that steering aims for; more takes corners wider."""
    side_weight: float = 8.0
    """Weight of missing free space against deviation from the path; more avoids and weaves more."""

    def __post_init__(self) -> None:
        """Reject tolerances that never settle."""
        if not 0.0 < self.go_on_rad < self.turn_in_place_rad < math.pi:
            raise ValueError(
                "angles must grow: 0 < go_on_rad < turn_in_place_rad < pi; got "
                f"{self.go_on_rad}, {self.turn_in_place_rad}"
            )
        if min(self.position_tolerance_m, self.angle_tolerance_rad, self.lookahead_m) <= 0.0:
            raise ValueError("tolerances and lookahead must be positive")
        if not (0.0 < self.slow_fraction <= 1.0 and 0.0 < self.braking_share <= 1.0):
            raise ValueError("slow_fraction and braking_share must lie in (0, 1]")
        margins = (
            self.slow_clearance_m,
            self.overlap_m,
            self.stop_margin_m,
            self.side_margin_m,
            self.side_weight,
        )
        if not all(0.0 <= margin < math.inf for margin in margins):
            raise ValueError(
                "slow_clearance_m, overlap_m, stop_margin_m, side_margin_m and side_weight must be "
                f"finite and at least 0; got {', '.join(map(str, margins))}"
            )


class PathFollower:
    """Computes velocity commands along a path, within the acceleration limits."""

    def __init__(self, config: FollowerConfig, robot: RobotProfile) -> None:
        self.config = config
        self._robot = robot
        self._last = Command()
        self._turning = False
        self._settling = False
        self._reached = False
        self._tilt_wait = TiltWait(robot)

    def resume_from(self, command: Command) -> None:
        """Replace the last command by the executed one, for the acceleration limits."""
        self._last = command

    @property
    def reached(self) -> bool:
        """Whether the robot has reached position, yaw and tilt of the last step's target.

        A tilt that does not come is not awaited without end; see `TiltWait`.
        """
        return self._reached

    def step(
        self,
        plan: Plan,
        T_world_base: Float64Array,
        tilt_rad: float,
        map_arrays: MapArrays,
        dt_s: float,
    ) -> Command:
        """Return the next command.

        Args:
            plan: Target and path.
            T_world_base: Pose of the robot.
            tilt_rad: Its camera's tilt.
            map_arrays: The map, whose obstacles may be newer than the plan.
            dt_s: Seconds since the last step.
        """
        self._reached = False
        if plan.target is None or len(plan.path_world) == 0:
            self._settling = False
            return self._limit(0.0, 0.0, tilt_rad, dt_s)
        target = plan.target
        here = T_world_base[:2, 3]
        self._settling = self._has_arrived(target, T_world_base)
        if self._settling:
            return self._settle(target, T_world_base, tilt_rad, dt_s)
        self._tilt_wait.restart()
        path = remaining_path(plan.path_world[:, :2], here[0], here[1])
        return self._drive(path, plan, target, T_world_base, map_arrays, dt_s)

    def _has_arrived(self, target: Viewpoint, T_world_base: Float64Array) -> bool:
        """Return whether the robot only has to turn to the target's yaw.

        It does not turn towards a target within `AT_NODE_M`: the planner assumes the same, and a
        turn would raise the cost of the target until the planner chose another one, and so on
        without end. A small drift while it turns does not send it back either.
        """
        dx, dy = (target.position_world[k] - T_world_base[k, 3] for k in range(2))
        away = math.hypot(dx, dy)
        off = abs(wrap_angle(math.atan2(dy, dx) - yaw_of(T_world_base)))
        tolerance = self.config.position_tolerance_m
        if self._settling:
            return away <= max(AT_NODE_M, 1.5 * tolerance)
        return away <= tolerance or (off > self.config.turn_in_place_rad and away <= AT_NODE_M)

    def _settle(
        self, target: Viewpoint, T_world_base: Float64Array, tilt_rad: float, dt_s: float
    ) -> Command:
        yaw_error = wrap_angle(target.yaw_rad - yaw_of(T_world_base))
        tilt = self._robot.within_tilt(target.tilt_rad)
        limit = self.config.angle_tolerance_rad
        faces = abs(yaw_error) <= limit and abs(self._last.linear_m_s) < 0.05
        self._reached = faces and self._tilt_wait.is_over(tilt - tilt_rad, limit, dt_s)
        self._turning = False
        return self._limit(0.0, self._turn_rate(yaw_error, dt_s), tilt, dt_s)

    def _drive(
        self,
        path: Float64Array,
        plan: Plan,
        target: Viewpoint,
        T_world_base: Float64Array,
        map_arrays: MapArrays,
        dt_s: float,
    ) -> Command:
        config, robot = self.config, self._robot
        reach = max(config.lookahead_m, 1.5 * abs(self._last.linear_m_s) * dt_s)
        aim = point_along(path, reach)
        off = wrap_angle(
            math.atan2(aim[1] - path[0, 1], aim[0] - path[0, 0]) - yaw_of(T_world_base)
        )
        backwards = self._must_reverse(off, plan, T_world_base, map_arrays)
        if backwards:
            path, off = path[:2], wrap_angle(off - math.pi)
        threshold = config.go_on_rad if self._turning else config.turn_in_place_rad
        self._turning = abs(off) > threshold
        rate = self._turn_rate(off, dt_s)
        tilt = self._robot.within_tilt(target.tilt_rad)
        if self._turning:
            return self._limit(0.0, rate, tilt, dt_s)
        braking = config.braking_share * robot.max_linear_acceleration_m_s2
        remaining = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
        reach = 0.5 * robot.max_linear_m_s**2 / braking + 0.4
        obstacles = self._hazards(map_arrays, T_world_base, reach + robot.radius_m, plan)
        room, free = self._free_ahead(path, obstacles, reach, backwards=backwards)
        speed = robot.max_linear_m_s * self._speed_fraction(room) * max(0.2, math.cos(1.5 * off))
        if not backwards:
            rate = self._steer_clear(T_world_base, max(speed, 0.2), rate, obstacles)
        for distance in (remaining, free):
            # With a long control period the robot drives for a whole step after the command.
            speed = min(speed, math.sqrt(2.0 * braking * distance), distance / (1.5 * dt_s))
        return self._limit(-speed if backwards else speed, rate, tilt, dt_s)

    def _must_reverse(
        self, off: float, plan: Plan, T_world_base: Float64Array, map_arrays: MapArrays
    ) -> bool:
        """Return whether a long body has to reverse, because it cannot turn to a path behind it."""
        robot = self._robot
        if robot.is_round or not robot.can_reverse or abs(off) < 0.5 * math.pi:
            return False
        if not plan.can_turn(off):
            return True
        reach = robot.radius_m + OVERLAP_TOLERANCE_M
        obstacles = self._hazards(map_arrays, T_world_base, reach, plan)
        turn = np.linspace(0.0, off, math.ceil(abs(off) / _TURN_STEP_RAD) + 1)
        here = np.tile(T_world_base[:2, 3], (len(turn), 1))
        poses = np.column_stack([here, yaw_of(T_world_base) + turn])
        room = disc_clearance(robot.outline, poses, obstacles)
        return bool(room.min() < min(-OVERLAP_TOLERANCE_M, float(room[0]) - 0.01))

    def _hazards(
        self, map_arrays: MapArrays, T_world_base: Float64Array, reach_m: float, plan: Plan
    ) -> Float64Array:
        return hazards_around(
            map_arrays, self._robot, T_world_base, reach_m, floor_z_m=plan.floor_z_m
        ).all

    def _free_ahead(
        self, path: Float64Array, obstacles: Float64Array, reach: float, *, backwards: bool
    ) -> tuple[float, float]:
        """Return the least free space on the first third of the reach, and the free path length."""
        if len(obstacles) == 0:
            return math.inf, math.inf
        steps = np.arange(0.0, reach, 0.04)
        poses = poses_along(path, steps)
        if backwards:
            poses[:, 2] += math.pi
        room = disc_clearance(self._robot.outline, poses, obstacles)
        # A voxel is up to half its edge off the surface. A robot that is too close already may
        # move, as long as it does not get closer.
        needed = np.minimum(-self.config.overlap_m, room[0] - 0.01)
        hit = np.flatnonzero(room < needed)
        free = math.inf
        if hit.size:
            free = max(0.0, float(steps[hit[0]]) - self.config.stop_margin_m)
        return float(room[: max(1, len(room) // 3)].min()), free

    def _steer_clear(
        self, T_world_base: Float64Array, speed: float, rate: float, obstacles: Float64Array
    ) -> float:
        """Return a turn rate near `rate` whose arc keeps free space beside the body.

        Steering for a point ahead cuts corners. A few neighbouring arcs are rated by their
        deviation from the wanted one and by their clearance.
        """
        if len(obstacles) == 0:
            return rate
        limit = self._robot.max_yaw_rate_rad_s
        rates = np.clip(rate + limit * np.linspace(-0.6, 0.6, 9), -limit, limit)
        # The wanted rate comes first, so that it wins ties.
        rates = np.concatenate([[rate], rates])
        t = np.linspace(0.15, 0.8, 6)
        half = 0.5 * rates[:, None] * t
        chord = speed * t * np.sinc(half / math.pi)
        heading = yaw_of(T_world_base) + half
        poses = np.stack(
            [
                T_world_base[0, 3] + chord * np.cos(heading),
                T_world_base[1, 3] + chord * np.sin(heading),
                heading + half,
            ],
            axis=2,
        )
        room = disc_clearance(self._robot.outline, poses.reshape(-1, 3), obstacles)
        room = room.reshape(len(rates), -1).min(axis=1)
        short = np.maximum(0.0, self.config.side_margin_m - room)
        cost = np.abs(rates - rate) / limit + self.config.side_weight * short
        return float(rates[int(np.argmin(cost))])

    def _speed_fraction(self, room: float) -> float:
        share = min(1.0, max(0.0, room / self.config.slow_clearance_m))
        return self.config.slow_fraction + (1.0 - self.config.slow_fraction) * share

    def _turn_rate(self, error: float, dt_s: float) -> float:
        """Return the turn rate that removes a heading error without overshoot."""
        limit = self._robot.max_yaw_rate_rad_s
        braking = self.config.braking_share * self._robot.max_yaw_acceleration_rad_s2
        rate = min(limit, math.sqrt(2.0 * braking * abs(error)), abs(error) / max(2.0 * dt_s, 0.2))
        return math.copysign(rate, error)

    def _limit(self, linear: float, yaw_rate: float, tilt: float, dt_s: float) -> Command:
        wanted = Command(linear_m_s=linear, yaw_rate_rad_s=yaw_rate, tilt_rad=tilt)
        self._last = limit_acceleration(wanted, self._last, self._robot, dt_s)
        return self._last
