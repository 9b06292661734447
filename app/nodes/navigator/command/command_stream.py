"""Publishes the latest command while it is fresh, and zero velocity otherwise."""

import dataclasses
import threading
import time

import zenoh

from app.messages import keys
from app.messages.motion import StampedTwist, encode_number, encode_twist
from app.nodes.navigator.command.goal_output import STALE_S as GOAL_STALE_S
from app.nodes.navigator.command.goal_output import GoalOutput, command_publisher
from ippon.command import Command, NavigationGoal
from ippon.geometry import Float64Array
from ippon.mission.safe_motion import moves_base


class CommandStream:
    """Publishes at a fixed rate from its own thread, and immediately on a new command."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        rate_hz: float,
        stale_s: float,
        goals: GoalOutput | None = None,
        *,
        velocities: bool = True,
    ) -> None:
        """Publish nothing until the first command.

        Args:
            session: An open session.
            robot: Key prefix.
            rate_hz: Messages a second.
            stale_s: Age from which a command counts as stale.
            goals: Sends the goals of a robot that takes them; None for one that does not.
            velocities: The robot takes velocities.
        """
        self._goals = goals
        self._velocities = velocities
        self._pose: Float64Array | None = None
        """Where the robot stands; None where that is not known now."""
        self._twist = command_publisher(session, f"{robot}/{keys.CMD_VEL}")
        self._tilt = command_publisher(session, f"{robot}/{keys.CMD_TILT}")
        self._period_s = 1.0 / rate_hz
        self._stale_s = stale_s
        self._lock = threading.Lock()
        self._command: Command | None = None
        self._sent = Command()
        self._stamp_ns = 0
        self._given_at = 0.0
        self._halted = self._held = False
        self._halts = 0
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._repeat, name="command stream", daemon=True)
        self._thread.start()

    def give(self, command: Command, stamp_ns: int, T_map_base: Float64Array | None = None) -> None:
        """Send a command now, and repeat it until it is stale.

        Args:
            command: Velocities or goal, and tilt.
            stamp_ns: Stamp of the frame that it answers.
            T_map_base: Where the robot stands; None for where it stood.
        """
        with self._lock:
            self._pose = self._pose if T_map_base is None else T_map_base
            self._command, self._stamp_ns = command, stamp_ns
            self._given_at = time.monotonic()
            self._send(command)

    @property
    def sent(self) -> Command:
        """The last command sent; its velocities are zero after a halt, a drop or when stale."""
        with self._lock:
            return self._sent

    def hold(self) -> None:
        """Let no command pass from now on, as `halt`, which follows; from any thread, at once.

        Without the lock: a thread that sends may hold it while the network is busy.
        """
        self._held = True

    def halt(self) -> None:
        """Send zero now and until `release`, whatever command is given."""
        with self._lock:
            self._halted = True
            self._halts += 1
            self._held = False
            self._send_zero()

    @property
    def halts(self) -> int:
        """Number of halts so far; `release` refers to it."""
        with self._lock:
            return self._halts

    def release(self, if_count: int) -> bool:
        """Pass commands again, beginning with the next one.

        Args:
            if_count: `halts` when the release was requested; a later halt stays in force, and a
                hold until its halt has come.

        Returns:
            Whether commands pass.
        """
        with self._lock:
            if self._halts != if_count or self._held:
                return False
            self._halted = False
            self._command = None
            return True

    def drop(self) -> None:
        """Discard the last command and send zero now."""
        with self._lock:
            self._end_command()

    def close(self) -> None:
        """End the thread, which sends zero last; one that the network holds up is left behind."""
        self._closed.set()
        self._thread.join(timeout=2.0)

    def _repeat(self) -> None:
        while not self._closed.wait(self._period_s):
            with self._lock:
                if self._command is None:
                    continue
                stale_s = self._stale_s
                if self._command.goal is not None:
                    stale_s = max(stale_s, GOAL_STALE_S)
                if time.monotonic() - self._given_at > stale_s:
                    self._end_command()
                else:
                    self._send(self._command)
        with self._lock:
            self._send_zero()

    def _send(self, command: Command) -> None:
        if self._halted or self._held:
            self._send_zero()
            return
        # The tilt first: a robot in lock-step waits for the twist.
        self._tilt.put(encode_number(command.tilt_rad))
        before, self._sent = self._sent, command
        if self._goals is not None:
            if command.goal is not None and moves_base(before):
                self._put_twist(0.0, 0.0)  # It would go on beside the robot's own navigation.
            self._send_goal(command.goal)
            if command.goal is not None:
                return  # Velocities would oppose those of the robot's own navigation.
        self._put_twist(command.linear_m_s, command.yaw_rate_rad_s)

    def _send_zero(self) -> None:
        self._sent = dataclasses.replace(self._sent, linear_m_s=0.0, yaw_rate_rad_s=0.0, goal=None)
        self._send_goal(None)
        self._put_twist(0.0, 0.0)

    def _end_command(self) -> None:
        self._command = None
        self._send_zero()
        self._pose = None  # Nobody knows where it is moved until the next frame.

    def _send_goal(self, goal: NavigationGoal | None) -> None:
        # Where goals are a topic, a stop is a goal at this place, and the robot drives to a wrong
        # one. Without a message, it stops by the silence.
        if self._goals is not None and self._pose is not None:
            self._goals.send(goal, self._pose, self._stamp_ns)

    def _put_twist(self, linear_m_s: float, yaw_rate_rad_s: float) -> None:
        if not self._velocities:
            return
        twist = StampedTwist(
            stamp_ns=self._stamp_ns, linear_m_s=linear_m_s, yaw_rate_rad_s=yaw_rate_rad_s
        )
        self._twist.put(encode_twist(twist))
