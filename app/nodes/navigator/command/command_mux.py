"""Multiplexes the commands of the planner and of the operator.

The mission commands once per frame, a few times per second; teleoperation needs a lower latency.
The multiplexer keeps the pose and the obstacles of the latest frame, and filters the operator's
input against them, at a fixed rate and whenever a message arrives.
"""

import dataclasses
import math
import threading
import time
from collections.abc import Callable
from typing import Final

import zenoh

from app.messages.driving import DriveStatus, TeleopTag
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.command.teleop_inbox import TeleopInbox, TeleopMessage
from app.nodes.navigator.command.touch import Touch
from ippon.command import Command
from ippon.control.acceleration_limits import limit_acceleration
from ippon.control.drive_mode import (
    NO_INPUT,
    STILL,
    DriveMode,
    blend_commands,
    follows_plan,
    scale_command,
)
from ippon.control.obstacles import Hazards, hazards_around
from ippon.control.safety_filter import (
    OVERLAP_TOLERANCE_M,
    checked_reach_m,
    filter_among_hazards,
    limits_ahead,
)
from ippon.frame import Frame
from ippon.geometry import Float64Array, base_pose, yaw_of
from ippon.mapping.arrays import MapArrays
from ippon.mission.safe_motion import MAX_AGE_S
from ippon.robot import RobotProfile

TICK_S: Final = 0.05
HAND_S: Final = 0.3
"""Silence after which the operator's input counts as released."""
HORIZON_S: Final = 0.4
"""Least time over which a command is checked for collisions, the age of the frame included."""
LEAST_REACH_M: Final = 2.5
"""Radius in which obstacles are kept for the filter, at least; fast robots brake for longer."""
HAND_ROOM_M: Final = 0.03
"""Clearance beside the body under teleoperation, added to half a voxel."""
REASON_S: Final = 0.6
"""Time for which an intervention of the filter is told: before an obstacle commands that are still
slow pass it, and those that follow do not."""

Refusal = Callable[[TeleopTag], str | None]


class CommandMux:
    """Blends, filters and sends commands; safe from any thread."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        profile: RobotProfile,
        stream: CommandStream,
        stale_s: float,
        *,
        refusal: Refusal,
        on_takeover: Callable[[], None],
    ) -> None:
        """Subscribe to teleoperation.

        Args:
            session: An open session.
            robot: Key prefix.
            profile: The robot's limits and body.
            stream: Sends the commands.
            stale_s: Longest silence between frames in which teleoperation may drive.
            refusal: Returns why a message is refused, None when it is accepted.
            on_takeover: Called when the operator drives while the robot goes to a waypoint.
        """
        self._profile = profile
        self._stream = stream
        self._stale_s = stale_s
        self._refusal = refusal
        self._on_takeover = on_takeover
        self._lock = threading.RLock()
        self._mode = DriveMode.AUTO
        self._limit = 1.0
        self._hand = NO_INPUT
        self._hand_at = -math.inf
        self._last_tag = TeleopTag(sender="", epoch=0, seq=-1)
        self._planned = Command()
        self._waypoint: tuple[float, float] | None = None
        self._pose: Float64Array | None = None
        self._hazards: Hazards | None = None
        self._voxel_m = 0.05
        self._stamp_ns = 0
        self._framed_at = -math.inf
        self._age_s = 0.0
        self._touch = Touch()
        self._horizon_s = HORIZON_S
        self._by_hand = False
        self._given = Command()
        self._given_at = time.monotonic()
        self._tilt_rad = 0.0
        self._intervention = ""
        self._intervened_at = -math.inf
        self._refused = ""
        self._refused_at = -math.inf
        self._driven = threading.Event()
        self._closed = False
        self._inbox = TeleopInbox(session, robot, profile)
        self._thread = threading.Thread(target=self._run, name="command mux", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed = True
        self._driven.set()
        self._thread.join(timeout=2.0)

    def set_mode(self, mode: DriveMode, speed_limit: float) -> None:
        """Set drive mode and speed limit; the operator's input is released."""
        with self._lock:
            self._mode, self._limit = mode, speed_limit
            self._hand = NO_INPUT
            self._inbox.open(is_open=mode is not DriveMode.AUTO)
            self._intervention, self._refused_at = "", -math.inf
            if mode is DriveMode.AUTO:
                self._driven.clear()
            else:
                self._driven.set()
                self._tick(time.monotonic())

    def let_go(self) -> None:
        """Release the operator's input, as when the lease is lost."""
        with self._lock:
            self._hand = NO_INPUT
            if self._mode is not DriveMode.AUTO:
                self._tick(time.monotonic())

    def by_hand(self) -> Command | None:
        """Return the last command if it came from the operator, None if from the plan."""
        with self._lock:
            return self._stream.sent if self._by_hand else None

    def follow(
        self,
        planned: Command,
        frame: Frame,
        arrays: MapArrays,
        waypoint: tuple[float, float] | None,
        age_s: float = 0.0,
        floor_z_m: float | None = None,
    ) -> Command:
        """Update pose and obstacles from a frame, and command.

        Args:
            planned: Command of the mission, already filtered.
            frame: The frame that it answers.
            arrays: The map that includes the frame.
            waypoint: Point that the operator sent the robot to, None for none.
            age_s: Seconds since the frame was taken, during which the robot has driven on.
            floor_z_m: Height at which the planner has read the floor, if it has.

        Returns:
            The command that was sent.
        """
        # The next command comes a tick later, or two.
        horizon_s = max(HORIZON_S, min(age_s, MAX_AGE_S) + 2 * TICK_S)
        hazards = self._hazards_near(frame, arrays, horizon_s, floor_z_m)
        with self._lock:
            self._horizon_s = horizon_s
            self._planned, self._waypoint = planned, waypoint
            self._pose, self._hazards = frame.T_world_base, hazards
            self._voxel_m = arrays.voxel_size
            self._stamp_ns = frame.stamp_ns
            self._framed_at = time.monotonic()
            self._age_s = age_s
            self._touch.saw(self._framed_at - age_s, contact=frame.contact)
            if self._mode is DriveMode.AUTO:
                self._tilt_rad = frame.tilt_rad
            return self._tick(self._framed_at)

    def _hazards_near(
        self, frame: Frame, arrays: MapArrays, horizon_s: float, floor_z_m: float | None
    ) -> Hazards:
        """Copy the obstacles and drops that matter: only the mission's thread may read the map."""
        robot = self._profile
        reach_m = max(LEAST_REACH_M, checked_reach_m(robot, robot.max_linear_m_s, horizon_s))
        # In Auto the mission's command is filtered already.
        auto = self._mode is DriveMode.AUTO
        newest = None if auto else frame
        at = frame.T_world_base
        return hazards_around(arrays, robot, at, reach_m, newest, floor_z_m, hidden=not auto)

    def status(self) -> DriveStatus:
        """Return drive mode, waypoint, limits and the filter's last intervention."""
        with self._lock:
            now = time.monotonic()
            fresh, refused = now - self._hand_at < HAND_S, now - self._refused_at < REASON_S
            speed = self._limit * self._profile.max_linear_m_s
            slow, stop = limits_ahead(self._profile, speed, HORIZON_S, self._hand_margin_m)
            return DriveStatus(
                mode=self._mode.value,
                speed_limit=self._limit,
                by_hand=fresh and self._hand.drives,
                intervention=self._refused if refused else self._intervention,
                waypoint=self._waypoint,
                top_linear_m_s=self._profile.max_linear_m_s,
                top_yaw_rate_rad_s=self._profile.max_yaw_rate_rad_s,
                top_tilt_rate_rad_s=self._profile.max_tilt_rate_rad_s,
                body_half_width_m=round(self._profile.half_width_m, 3),
                slow_within_m=round(slow, 3),
                stop_within_m=round(stop, 3),
            )

    @property
    def _hand_margin_m(self) -> float:
        return 0.5 * self._voxel_m + HAND_ROOM_M

    # -- teleoperation ------------------------------------------------------------------------

    def _take(self, message: TeleopMessage) -> None:
        if not message.tag.follows(self._last_tag):
            return
        if (problem := self._refusal(message.tag)) is not None:
            self._refused, self._refused_at = problem, message.at
            return
        self._last_tag, self._refused_at = message.tag, -math.inf
        self._hand, self._hand_at = message.hand, message.at
        # One that waited while the robot took no command is older than a waypoint given since.
        is_fresh = time.monotonic() - message.at <= HAND_S
        if is_fresh and message.hand.drives and self._waypoint is not None:
            self._waypoint = None
            self._on_takeover()

    # -- the command -------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._closed:
            self._driven.wait()
            with self._lock:
                if self._mode is not DriveMode.AUTO and not self._closed:
                    for message in self._inbox.take():
                        self._take(message)
                    self._tick(time.monotonic())
            self._inbox.wait(TICK_S)

    def _tick(self, now: float) -> Command:
        self._dead_reckon(now)
        if now - self._hand_at > HAND_S:
            self._hand = NO_INPUT
        command = self._command(now)
        self._given, self._given_at = command, now
        self._touch.drove(command.linear_m_s, now)
        # The plan's own command is given once per frame: the stream repeats it, and ends it when
        # frames stop.
        if self._framed_at > -math.inf and (now == self._framed_at or not self._drives_itself):
            # Once frames stop, nobody knows where the robot is moved.
            is_seen = now - self._framed_at <= self._stale_s
            self._stream.give(command, self._stamp_ns, self._pose if is_seen else None)
        return command

    @property
    def _drives_itself(self) -> bool:
        """Whether the robot follows the plan, or goes to a waypoint, without the operator."""
        to_waypoint = self._waypoint is not None and not self._hand.drives
        return self._mode is DriveMode.AUTO or to_waypoint

    def _command(self, now: float) -> Command:
        if self._drives_itself:
            self._intervention = ""
            self._by_hand = False
            self._tilt_rad = self._planned.tilt_rad
            return scale_command(self._planned, self._limit)
        planned_tilt = follows_plan(self._mode, self._hand)
        # Under the operator's hand the robot does not navigate by itself.
        planned = dataclasses.replace(self._planned, goal=None)
        self._by_hand = not planned_tilt
        blended = blend_commands(self._mode, self._hand, planned, self._profile)
        wanted = self._eased(scale_command(blended, self._limit), now)
        if not planned_tilt:
            wanted = dataclasses.replace(wanted, tilt_rad=self._tilted(now))
        self._tilt_rad = wanted.tilt_rad
        if not self._hand.drives:
            self._intervention = ""
            return wanted
        return self._filtered(wanted, now, as_planned=planned_tilt)

    def _eased(self, wanted: Command, now: float) -> Command:
        """Limit the acceleration; braking is immediate."""
        dt_s = min(now - self._given_at, 2 * TICK_S)
        return limit_acceleration(
            wanted, self._stream.sent, self._profile, dt_s, brakes_at_once=True
        )

    def _filtered(self, wanted: Command, now: float, *, as_planned: bool) -> Command:
        still = dataclasses.replace(wanted, linear_m_s=0.0, yaw_rate_rad_s=0.0)
        silent_s = now - self._framed_at
        if self._pose is None or self._hazards is None or silent_s > self._stale_s:
            self._intervention = f"stopped: no picture for {silent_s:.1f} s"
            return still
        if self._age_s > MAX_AGE_S:  # The filter does not look so far ahead.
            self._intervention = (
                f"stopped: the newest picture was {self._age_s:.1f} s old when it was in the map: "
                "this machine is slow or busy"
            )
            return still
        is_blocked = self._touch.blocks(wanted.linear_m_s)
        if is_blocked:
            wanted = dataclasses.replace(wanted, linear_m_s=0.0)
        hazards = self._hazards if as_planned else self._hazards.by_hand
        margin = -OVERLAP_TOLERANCE_M if as_planned else self._hand_margin_m
        safe, reason = filter_among_hazards(
            wanted, self._pose, self._profile, hazards, self._horizon_s, margin, 1e-6
        )
        if is_blocked:
            reason = "stopped: the bumper is pressed"
        if reason is not None:
            self._intervention, self._intervened_at = reason, now
        elif now - self._intervened_at > REASON_S:
            self._intervention = ""
        return safe

    def _tilted(self, now: float) -> float:
        rate = self._hand.tilt * self._profile.max_tilt_rate_rad_s * self._limit
        return self._profile.within_tilt(
            self._tilt_rad + rate * min(now - self._given_at, TICK_S * 2)
        )

    def _dead_reckon(self, now: float) -> None:
        """Advance the pose by dead reckoning with the commands since it was measured."""
        if self._pose is None or self._framed_at == now:
            return
        dt_s = min(now - max(self._given_at, self._framed_at), self._stale_s)
        v, w = self._given.linear_m_s, self._given.yaw_rate_rad_s
        if dt_s <= 0.0 or (abs(v) < STILL and abs(w) < STILL):
            return
        yaw = yaw_of(self._pose)
        middle = yaw + 0.5 * w * dt_s
        x, y, z = self._pose[:3, 3].tolist()
        self._pose = base_pose(
            x + v * dt_s * math.cos(middle), y + v * dt_s * math.sin(middle), z, yaw + w * dt_s
        )
