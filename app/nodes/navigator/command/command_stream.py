"""The command stream: the latest command while it is fresh, zero otherwise."""

import dataclasses
import threading
import time

import zenoh

from app.messages import keys
from app.messages.motion import StampedTwist, encode_number, encode_twist
from ippon.command import Command


class CommandStream:
    """Publishes at a fixed rate from its own thread, and at once when a new command comes."""

    def __init__(self, session: zenoh.Session, robot: str, rate_hz: float, stale_s: float) -> None:
        self._twist = session.declare_publisher(
            f"{robot}/{keys.CMD_VEL}",
            priority=zenoh.Priority.REAL_TIME,
            congestion_control=zenoh.CongestionControl.BLOCK,
            express=True,
        )
        self._tilt = session.declare_publisher(
            f"{robot}/{keys.CMD_TILT}",
            priority=zenoh.Priority.REAL_TIME,
            congestion_control=zenoh.CongestionControl.BLOCK,
            express=True,
        )
        self._period_s = 1.0 / rate_hz
        self._stale_s = stale_s
        self._lock = threading.Lock()
        self._command: Command | None = None
        self._sent = Command()
        self._stamp_ns = 0
        self._given_at = 0.0
        self._halted = False
        self._halts = 0
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._repeat, name="commander", daemon=True)
        self._thread.start()

    def give(self, command: Command, stamp_ns: int) -> None:
        """Send a command now, and repeat it until it is stale.

        Args:
            command: What to do.
            stamp_ns: Stamp of the frame that it answers.
        """
        with self._lock:
            self._command, self._stamp_ns = command, stamp_ns
            self._given_at = time.monotonic()
            self._send(command)

    @property
    def sent(self) -> Command:
        """What the robot was told last: zero also where a command was halted, dropped or stale."""
        with self._lock:
            return self._sent

    def halt(self) -> None:
        """Send zero now and until `release`, whatever is given."""
        with self._lock:
            self._halted = True
            self._halts += 1
            self._send_zero()

    @property
    def halts(self) -> int:
        """How often it was halted so far: what a later `release` is meant for."""
        with self._lock:
            return self._halts

    def release(self, if_count: int) -> bool:
        """Let commands pass again, from the next one on.

        Args:
            if_count: `halts` when the release was asked for; a halt since then stands.

        Returns:
            Whether commands pass.
        """
        with self._lock:
            if self._halts != if_count:
                return False
            self._halted = False
            self._command = None
            return True

    def drop(self) -> None:
        """Send zero now: what the last command was for is gone."""
        with self._lock:
            self._command = None
            self._send_zero()

    def close(self) -> None:
        """Send zero and end."""
        self._closed.set()
        self._thread.join(timeout=2.0)
        with self._lock:
            self._send_zero()

    def _repeat(self) -> None:
        while not self._closed.wait(self._period_s):
            with self._lock:
                if self._command is None:
                    continue
                if time.monotonic() - self._given_at > self._stale_s:
                    self._command = None
                    self._send_zero()
                else:
                    self._send(self._command)

    def _send(self, command: Command) -> None:
        if self._halted:
            self._send_zero()
            return
        # The tilt first: the twist is what a robot in lock-step waits for.
        self._tilt.put(encode_number(command.tilt_rad))
        self._sent = command
        self._put_twist(command.linear_m_s, command.yaw_rate_rad_s)

    def _send_zero(self) -> None:
        self._sent = dataclasses.replace(self._sent, linear_m_s=0.0, yaw_rate_rad_s=0.0)
        self._put_twist(0.0, 0.0)

    def _put_twist(self, linear_m_s: float, yaw_rate_rad_s: float) -> None:
        twist = StampedTwist(
            stamp_ns=self._stamp_ns, linear_m_s=linear_m_s, yaw_rate_rad_s=yaw_rate_rad_s
        )
        self._twist.put(encode_twist(twist))
