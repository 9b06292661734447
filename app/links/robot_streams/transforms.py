"""The tree of coordinate frames, as tf messages build it."""

from bisect import bisect_left
from collections import deque
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from app.messages.cdr import MessageError
from app.messages.motion import StampedTransform
from ippon.frame import NANOSECONDS
from ippon.geometry import Float64Array, make_transform

HISTORY: Final = 200
MAX_CHAIN: Final = 20
BACKWARDS_NS: Final = NANOSECONDS
"""Step back from which the clock counts as restarted; smaller ones are messages out of order."""
MAX_FRAMES: Final = 500


class TransformBuffer:
    """Looks up poses at a stamp; interpolates between messages and does not extrapolate."""

    def __init__(self, tolerance_s: float = 0.05) -> None:
        self._tolerance_ns = round(NANOSECONDS * tolerance_s)
        self._moving: dict[str, deque[StampedTransform]] = {}
        self._fixed: dict[str, StampedTransform] = {}

    def add(self, transform: StampedTransform, *, fixed: bool = False) -> None:
        """Take a transform; `fixed` ones are valid at every stamp.

        Raises:
            MessageError: It names yet another frame, and there are too many already.
        """
        known = self._moving.keys() | self._fixed.keys()
        if transform.child not in known and len(known) >= MAX_FRAMES:
            raise MessageError(f"tf names more than {MAX_FRAMES} coordinate frames")
        if fixed:
            self._fixed[transform.child] = transform
            return
        history = self._moving.setdefault(transform.child, deque(maxlen=HISTORY))
        if history and transform.stamp_ns < history[-1].stamp_ns:
            if history[-1].stamp_ns - transform.stamp_ns < BACKWARDS_NS:
                return
            history.clear()
        history.append(transform)

    def lookup(self, target: str, source: str, stamp_ns: int) -> Float64Array | None:
        """Return T_target_source (4, 4) at a stamp, None while it is not known."""
        T = np.eye(4)
        frame = source
        for _ in range(MAX_CHAIN):
            if frame == target:
                return T
            step = self._at(frame, stamp_ns)
            if step is None:
                return None
            T = step.T_parent_child @ T
            frame = step.parent
        return None

    def _at(self, child: str, stamp_ns: int) -> StampedTransform | None:
        history = self._moving.get(child)
        if not history:
            return self._fixed.get(child)
        stamps = [t.stamp_ns for t in history]
        k = bisect_left(stamps, stamp_ns)
        if k < len(stamps) and stamps[k] == stamp_ns:
            return history[k]
        if k == len(stamps):
            return history[-1] if stamp_ns - stamps[-1] <= self._tolerance_ns else None
        if k == 0:
            return history[0] if stamps[0] - stamp_ns <= self._tolerance_ns else None
        return _between(history[k - 1], history[k], stamp_ns)


def _between(a: StampedTransform, b: StampedTransform, stamp_ns: int) -> StampedTransform:
    w = (stamp_ns - a.stamp_ns) / (b.stamp_ns - a.stamp_ns)
    rotations = Rotation.from_matrix(np.stack([a.T_parent_child[:3, :3], b.T_parent_child[:3, :3]]))
    rotation = Slerp([0.0, 1.0], rotations)(w).as_matrix()
    translation = (1 - w) * a.T_parent_child[:3, 3] + w * b.T_parent_child[:3, 3]
    return StampedTransform(
        stamp_ns=stamp_ns,
        parent=a.parent,
        child=a.child,
        T_parent_child=make_transform(rotation, translation),
    )
