"""The simulated base: speed limits, inertia, latency, watchdog, contact with walls, drops."""

import math
from collections import deque
from dataclasses import dataclass

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.geometry import Float64Array, base_pose, wrap_angle
from ippon.robot import RobotProfile
from ippon.simulation.robot.contact import BodyContacts
from ippon.simulation.robot.floor_support import FloorSupport
from ippon.simulation.scene import Scene, StartPose

_TOUCH_M = 1e-4
"""Penetration in metres below which there is no contact; allows for rounding while sliding."""
_STUCK_SHARE = 0.2
"""Sliding over less than this share of the commanded distance stops the wheels."""
_WHEEL_RING = 0.6
"""Distance of the wheels from the centre, as a share of the body's radius."""


def camera_of(robot: RobotProfile, width: int) -> PinholeCamera:
    """Return a robot's camera for images of a width in pixels."""
    height = round(width / robot.image_aspect)
    return PinholeCamera.from_horizontal_fov(width, height, robot.horizontal_fov_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseConfig:
    """Behaviour of the simulated base that the robot profile does not describe."""

    sliding: bool = True
    """Slide along obstacles; without it the base stops at contact."""
    command_timeout_s: float = 0.5
    """Time without a command after which the base brakes to a stop."""
    brake_factor: float = 5.0
    """Deceleration after the time-out over the profile's acceleration; larger stops sooner."""
    latency_s: float = 0.0
    """Delay from a command to its effect."""
    tick_s: float = 0.02
    """Integration step; smaller follows curves and walls more accurately and costs time."""

    def __post_init__(self) -> None:
        """Reject times and factors out of range."""
        if not self.brake_factor >= 1.0:
            raise ValueError(f"brake_factor must be at least 1; got {self.brake_factor}")
        if not (self.command_timeout_s > 0.0 and self.latency_s >= 0.0 and self.tick_s > 0.0):
            raise ValueError(
                "command_timeout_s and tick_s must be positive and latency_s at least 0; got "
                f"{self.command_timeout_s}, {self.tick_s}, {self.latency_s}"
            )


class SimulatedBase:
    """A differential drive with a tilting camera on one floor of a scene.

    A step that would increase penetration, or move the wheels off the floor, is not made. A robot
    that is placed in contact with a wall can therefore drive away from it.
    """

    def __init__(
        self,
        scene: Scene,
        robot: RobotProfile,
        start: StartPose,
        config: BaseConfig | None = None,
    ) -> None:
        self.robot = robot
        self.config = config or BaseConfig()
        self.x_m, self.y_m, self.z_m = start.x, start.y, start.z
        self.yaw_rad = wrap_angle(start.yaw)
        self.tilt_rad = robot.within_tilt(0.0)
        self.linear_m_s = 0.0
        self.yaw_rate_rad_s = 0.0
        self.contact = False
        """An obstacle stopped or deflected the base during the last step."""
        self.collisions = 0
        """Number of times that contact began."""
        self._contacts = BodyContacts(scene, robot.spheres, start.z)
        self._floor = FloorSupport(scene, start.z, robot.max_step_m, _WHEEL_RING * robot.radius_m)
        self._time_ns = 0
        self._pending: deque[tuple[int, Command]] = deque()
        self._command = Command(tilt_rad=self.tilt_rad)
        self._command_ns: int | None = None

    @property
    def T_world_base(self) -> Float64Array:  # noqa: N802
        """Return the true (4, 4) pose of the base."""
        return base_pose(self.x_m, self.y_m, self.z_m, self.yaw_rad)

    def step(self, command: Command | None, dt_s: float) -> None:
        """Advance by `dt_s` seconds of simulated time.

        Args:
            command: A new command, or None.
            dt_s: Duration, positive.

        Raises:
            ValueError: The command or the duration is not finite, or the duration not positive.
        """
        if not (math.isfinite(dt_s) and dt_s > 0.0):
            raise ValueError(f"a step takes a positive, finite number of seconds; got {dt_s}")
        if command is not None:
            self._accept(command)
        was_in_contact, self.contact = self.contact, False
        ticks = max(1, math.ceil(dt_s / self.config.tick_s - 1e-9))
        tick_ns = round(dt_s * 1e9) / ticks
        begin_ns = self._time_ns
        for k in range(ticks):
            self._time_ns = begin_ns + round((k + 1) * tick_ns)
            self._tick(tick_ns * 1e-9)
        if self.contact and not was_in_contact:
            self.collisions += 1

    def _accept(self, command: Command) -> None:
        values = (command.linear_m_s, command.yaw_rate_rad_s, command.tilt_rad)
        if not all(math.isfinite(value) for value in values):
            raise ValueError(f"a command needs finite numbers; got {command}")
        self._pending.append((self._time_ns + round(self.config.latency_s * 1e9), command))

    def _tick(self, dt_s: float) -> None:
        while self._pending and self._pending[0][0] < self._time_ns:
            self._command_ns, self._command = self._pending.popleft()
        linear, yaw_rate = self._wanted_velocities()
        robot = self.robot
        gain_s = dt_s * (self.config.brake_factor if self._is_abandoned() else 1.0)
        self.linear_m_s = _approach(
            self.linear_m_s, linear, robot.max_linear_acceleration_m_s2 * gain_s
        )
        self.yaw_rate_rad_s = _approach(
            self.yaw_rate_rad_s, yaw_rate, robot.max_yaw_acceleration_rad_s2 * gain_s
        )
        tilt = robot.within_tilt(self._command.tilt_rad)
        self.tilt_rad = _approach(self.tilt_rad, tilt, robot.max_tilt_rate_rad_s * dt_s)
        self._turn(self.yaw_rate_rad_s * dt_s)
        self._drive(self.linear_m_s * dt_s)

    def _is_abandoned(self) -> bool:
        """Tell whether the last command is older than the time-out."""
        timeout_ns = round(self.config.command_timeout_s * 1e9)
        return self._command_ns is None or self._time_ns - self._command_ns > timeout_ns

    def _wanted_velocities(self) -> tuple[float, float]:
        """Return the last command clipped to the limits; zero after the time-out."""
        if self._is_abandoned():
            return 0.0, 0.0
        robot = self.robot
        slowest = -robot.max_linear_m_s if robot.can_reverse else 0.0
        linear = min(max(self._command.linear_m_s, slowest), robot.max_linear_m_s)
        fastest_turn = robot.max_yaw_rate_rad_s
        return linear, min(max(self._command.yaw_rate_rad_s, -fastest_turn), fastest_turn)

    def _turn(self, angle: float) -> None:
        if angle == 0.0:
            return
        yaw = wrap_angle(self.yaw_rad + angle)
        before = self._contacts.deepest(self.x_m, self.y_m, self.yaw_rad).depth_m
        after = self._contacts.deepest(self.x_m, self.y_m, yaw).depth_m
        if after > max(before, _TOUCH_M) + 1e-9:
            self.contact = True
            self.yaw_rate_rad_s = 0.0
        else:
            self.yaw_rad = yaw

    def _drive(self, distance: float) -> None:
        if distance == 0.0:
            return
        dx, dy = distance * math.cos(self.yaw_rad), distance * math.sin(self.yaw_rad)
        allowed = max(self._contacts.deepest(self.x_m, self.y_m, self.yaw_rad).depth_m, _TOUCH_M)
        x, y = self.x_m + dx, self.y_m + dy
        if self._is_allowed(x, y, allowed):
            self.x_m, self.y_m = x, y
            return
        self.contact = True
        end = self._slide(x, y, allowed, abs(distance)) if self.config.sliding else None
        if end is None:
            end = self._touch(dx, dy, allowed)
        moved = math.hypot(end[0] - self.x_m, end[1] - self.y_m)
        self.x_m, self.y_m = end
        if moved < _STUCK_SHARE * abs(distance) or not self.config.sliding:
            self.linear_m_s = 0.0

    def _touch(self, dx: float, dy: float, allowed_m: float) -> tuple[float, float]:
        """Return the farthest free position along the motion, to a thousandth of its length."""
        free, blocked = 0.0, 1.0
        for _ in range(10):
            middle = 0.5 * (free + blocked)
            if self._is_allowed(self.x_m + middle * dx, self.y_m + middle * dy, allowed_m):
                free = middle
            else:
                blocked = middle
        return self.x_m + free * dx, self.y_m + free * dy

    def _is_allowed(self, x: float, y: float, allowed_m: float) -> bool:
        if self._contacts.deepest(x, y, self.yaw_rad).depth_m > allowed_m + 1e-9:
            return False
        return self._floor.carries(x, y) or not self._floor.carries(self.x_m, self.y_m)

    def _slide(
        self, x: float, y: float, allowed_m: float, distance_m: float
    ) -> tuple[float, float] | None:
        """Push the position out of obstacles; None if no free position is found."""
        for _ in range(4):
            depth, nx, ny = self._contacts.deepest(x, y, self.yaw_rad)
            if depth <= allowed_m:
                break
            x, y = x + nx * depth, y + ny * depth
        moved = math.hypot(x - self.x_m, y - self.y_m)
        if moved > distance_m or not self._is_allowed(x, y, allowed_m):
            return None
        return x, y


def _approach(value: float, target: float, most: float) -> float:
    return target if abs(target - value) <= most else value + math.copysign(most, target - value)
