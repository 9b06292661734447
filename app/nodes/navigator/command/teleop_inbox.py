"""Messages of the operator's hand, until the thread that commands takes them."""

import contextlib
import logging
import queue
import threading
import time
from typing import Final, NamedTuple

import msgspec
import zenoh

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.control import decode
from app.messages.driving import TeleopTag
from app.messages.motion import StampedTwist, decode_twist
from ippon.control.drive_mode import TeleopInput
from ippon.robot import RobotProfile

logger = logging.getLogger(__name__)

_MOST: Final = 1000
"""Messages that wait at most; a page sends twenty a second."""


class TeleopMessage(NamedTuple):
    """One message."""

    tag: TeleopTag
    hand: TeleopInput
    at: float
    """Time of arrival, seconds of the monotonic clock."""


class TeleopInbox:
    """Subscribes to teleoperation; nothing that a robot or a map does delays it.

    The Stop of the same operator comes through the same network thread, which must not wait for a
    command that a robot on a bad line does not take.
    """

    def __init__(self, session: zenoh.Session, robot: str, profile: RobotProfile) -> None:
        """Subscribe; messages count once it is `open`.

        Args:
            session: An open session.
            robot: Key prefix.
            profile: The robot's top speeds.
        """
        self._profile = profile
        self._is_open = False
        self._messages: queue.Queue[TeleopMessage] = queue.Queue(_MOST)
        self._arrived = threading.Event()
        handler = zenoh.handlers.Callback(self._receive, indirect=False)
        self._subscriber = session.declare_subscriber(f"{robot}/{keys.TELEOP}", handler)  # pyright: ignore[reportArgumentType, reportCallIssue]

    def open(self, *, is_open: bool) -> None:
        """Discard what has arrived; later messages count or not."""
        self._is_open = is_open
        self.take()

    def take(self) -> list[TeleopMessage]:
        """Return what has arrived since, oldest first."""
        self._arrived.clear()
        taken: list[TeleopMessage] = []
        with contextlib.suppress(queue.Empty):
            while True:
                taken.append(self._messages.get_nowait())
        return taken

    def wait(self, timeout_s: float) -> None:
        """Wait for a message, at most so long."""
        self._arrived.wait(timeout_s)

    def _receive(self, sample: zenoh.Sample) -> None:
        if not self._is_open:
            return
        try:
            attached = sample.attachment
            tag = decode(b"" if attached is None else attached.to_bytes(), TeleopTag)
            hand = self._hand_of(decode_twist(sample.payload.to_bytes()))
        except (MessageError, msgspec.DecodeError) as error:
            logger.debug("a teleoperation message is skipped: %s", error)
            return
        with contextlib.suppress(queue.Full):
            self._messages.put_nowait(TeleopMessage(tag, hand, time.monotonic()))
        self._arrived.set()

    def _hand_of(self, twist: StampedTwist) -> TeleopInput:
        robot = self._profile

        def share(value: float, top: float) -> float:
            return min(max(value / top, -1.0), 1.0)

        return TeleopInput(
            forward=share(twist.linear_m_s, robot.max_linear_m_s),
            turn=share(twist.yaw_rate_rad_s, robot.max_yaw_rate_rad_s),
            tilt=share(twist.tilt_rate_rad_s, robot.max_tilt_rate_rad_s),
        )
