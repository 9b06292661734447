"""Notices that images and poses of a moving robot are not of the same moment."""

import threading
import time
from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.links.robot_streams.clock_offset import ClockOffset, estimate_offset
from app.links.robot_streams.transforms import TransformBuffer
from app.messages.cdr import MessageError
from app.messages.motion import decode_transforms
from ippon.camera import PinholeCamera
from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import wrap_angle, yaw_of

IMAGES: Final = 20
APART_S: Final = 0.15
"""Least time from one image that is compared to the next."""
LEAST_CHANGE_RAD_S: Final = 0.3
"""Change of the turning rate without which nothing is compared: all offsets look alike."""
EVERY_S: Final = 60.0
"""Time to the next comparison."""
SOON_S: Final = 10.0
"""The same after the first one, and after one that contradicts the last."""
TOLERATED_S: Final = 0.05
AGREE_S: Final = 0.03
"""Difference of two estimates in a row up to which they agree."""
_POSES: Final = 2000
"""Messages of tf that are kept."""
_FIXED: Final = 50
LONGEST: Final = 2**16
"""Bytes of a message of tf beyond which it is left out: 600 transforms."""


class ClockWatch:
    """Estimates the offset of the clocks from time to time, in a thread of its own.

    Args:
        world_frame: Of the poses.
        known_s: How far the camera's clock is behind that of the poses, by the profile.
    """

    def __init__(self, world_frame: str, known_s: float) -> None:
        self._world_frame, self._known_s = world_frame, known_s
        self._lock = threading.Lock()
        self._poses: deque[bytes] = deque(maxlen=_POSES)
        self._fixed: deque[bytes] = deque(maxlen=_FIXED)
        self._depths: deque[tuple[int, NDArray[np.float32]]] = deque(maxlen=IMAGES)
        self._yaws: deque[float] = deque(maxlen=IMAGES)
        self._estimates: deque[ClockOffset] = deque(maxlen=2)
        self._due_at = 0.0
        self._thread: threading.Thread | None = None

    def add_transforms(self, payload: bytes, *, fixed: bool) -> None:
        """Take a message of tf or tf_static, from any thread."""
        if len(payload) > LONGEST:
            return
        with self._lock:
            (self._fixed if fixed else self._poses).append(payload)

    def add(self, frame: Frame, camera_frame: str) -> None:
        """Take a frame, and begin a comparison if it is time for one and the robot turns.

        Args:
            frame: With the poses at its stamp, as it came.
            camera_frame: Coordinate frame of the camera.
        """
        if self._depths and frame.stamp_ns <= self._depths[-1][0]:
            self._depths.clear()
            self._yaws.clear()
        if self._depths and frame.stamp_ns - self._depths[-1][0] < APART_S * NANOSECONDS:
            return
        self._depths.append((frame.stamp_ns, frame.depth))
        self._yaws.append(yaw_of(frame.T_world_base))
        if time.monotonic() < self._due_at or not self._is_turning():
            return
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(
                target=self._compare,
                args=(tuple(self._depths), frame.camera, camera_frame),
                name="clock comparison",
                daemon=True,
            )
            self._due_at = time.monotonic() + SOON_S
            self._thread.start()

    def problem(self) -> str:
        """Return how far the clocks are apart, for the operator; empty while they may agree."""
        estimates = tuple(self._estimates)
        if len(estimates) < 2 or not all(map(_is_apart, estimates)) or not _agree(*estimates):
            return ""
        offset_ms = 1e3 * estimates[-1].offset_s
        return (
            f"by what the camera sees, the stamps of images and poses are {abs(offset_ms):.0f} ms "
            f"apart: at 1 rad/s the map is turned by {0.0573 * abs(offset_ms):.0f} degrees; give "
            f"the profile `clock_offset_ms: {1e3 * self._known_s + offset_ms:.0f}` under `camera`, "
            "or let the driver stamp images when they are exposed"
        )

    def _is_turning(self) -> bool:
        if len(self._depths) < IMAGES:
            return False
        stamps_s = np.array([stamp for stamp, _ in self._depths]) / NANOSECONDS
        rates = [wrap_angle(turn) for turn in np.diff(self._yaws)] / np.diff(stamps_s)
        return float(np.ptp(rates)) > LEAST_CHANGE_RAD_S

    def _compare(
        self,
        depths: tuple[tuple[int, NDArray[np.float32]], ...],
        camera: PinholeCamera,
        camera_frame: str,
    ) -> None:
        buffer, known_ns = TransformBuffer(history=_POSES), round(NANOSECONDS * self._known_s)
        with self._lock:
            messages = ((tuple(self._fixed), True), (tuple(self._poses), False))
        for payloads, fixed in messages:
            for payload in payloads:
                try:
                    for transform in decode_transforms(payload):
                        buffer.add(transform, fixed=fixed)
                except MessageError:
                    # The intake, which gets the same message, counts and reports it.
                    continue
        estimate = estimate_offset(
            depths, camera,
            lambda stamp_ns: buffer.lookup(self._world_frame, camera_frame, stamp_ns + known_ns),
        )  # fmt: skip
        if estimate is None:
            return
        self._estimates.append(estimate)
        if len(self._estimates) == 2 and _agree(*self._estimates):
            self._due_at = time.monotonic() + EVERY_S


def _is_apart(estimate: ClockOffset) -> bool:
    return abs(estimate.offset_s) > max(TOLERATED_S, 3.0 * estimate.error_s)


def _agree(one: ClockOffset, other: ClockOffset) -> bool:
    return abs(one.offset_s - other.offset_s) <= AGREE_S
