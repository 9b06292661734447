"""Whether a robot rests: it stands, and searches for nothing."""

from collections.abc import Iterable
from typing import Final

import numpy as np

from app.messages.motion import StampedTransform
from app.messages.recording import RecordingGap
from app.messages.status import Event, Status
from app.recording.timeline import TimelineMessage, Transforms

REST_AFTER_S: Final = 5.0
"""Time without motion, search or event after which a robot rests."""
SILENT_S: Final = 2.0
"""Silence of the navigator after which it is not known what the robot does."""
MOVED_M: Final = 0.02
MOVED_RAD: Final = 0.02
_AT_REST: Final = frozenset({"starting", "found", "exhausted", "paused", "stopped"})


class RestWatch:
    """Follows statuses, events and transforms; a robot without them never rests.

    A frame that moves, such as the leg of a robot that walks on the spot, counts as motion.
    """

    def __init__(self) -> None:
        self._stood: dict[str, StampedTransform] = {}
        """Transforms as they were when they moved last, by the frame's name."""
        self._is_idle = False
        self._active_at: float | None = None
        self._heard_at: float | None = None

    def note(self, message: TimelineMessage | None, now_s: float) -> None:
        """Take a decoded message, and its time of arrival on a monotonic clock."""
        if isinstance(message, Status):
            was_silent = self._heard_at is None or now_s - self._heard_at > SILENT_S
            self._heard_at = now_s
            self._is_idle = message.state in _AT_REST
            if was_silent or not self._is_idle:
                self._active_at = now_s
        elif isinstance(message, Transforms):
            if not message.are_fixed and self._has_moved(message.transforms):
                self._active_at = now_s
        elif isinstance(message, Event | RecordingGap):
            # After a gap nothing is thinned, so that the next whole map is in the recording.
            self._active_at = now_s

    def is_at_rest(self, now_s: float) -> bool:
        """Return whether the robot has rested for a while."""
        if not self._is_idle or not self._stood:
            return False
        if self._active_at is None or self._heard_at is None:
            return False
        return now_s - self._heard_at <= SILENT_S and now_s - self._active_at >= REST_AFTER_S

    def _has_moved(self, transforms: Iterable[StampedTransform]) -> bool:
        moved = False
        for one in transforms:
            before = self._stood.get(one.child)
            if before is None or _differ(before, one):
                self._stood[one.child] = one
                moved = True
        return moved


def _differ(one: StampedTransform, other: StampedTransform) -> bool:
    change = np.abs(one.T_parent_child - other.T_parent_child)
    # Elements of a rotation matrix change by no more than the angle.
    return bool(change[:3, 3].max() > MOVED_M or change[:3, :3].max() > MOVED_RAD)
