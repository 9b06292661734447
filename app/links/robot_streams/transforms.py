"""The tree of coordinate frames, as tf messages build it."""

from bisect import bisect_left
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from app.messages.cdr import MessageError
from app.messages.motion import StampedTransform
from ippon.frame import NANOSECONDS
from ippon.geometry import Float64Array, make_transform

HISTORY: Final = 200
MAX_CHAIN: Final = 20
BACKWARDS_NS: Final = NANOSECONDS
"""Step back from which the clock counts as restarted; smaller ones are messages out of order."""
MAX_FRAMES: Final = 500
LONGEST_GAP_NS: Final = NANOSECONDS
"""Time between two poses beyond which none is interpolated: a turn in between would be missed."""
BASELINE_NS: Final = 40_000_000
"""Least time between the two poses that a velocity is taken from; jitter counts less over more."""


class TransformBuffer:
    """Looks up poses at a stamp.

    Between messages it interpolates; up to `tolerance_s` beyond the newest, or before the oldest,
    it goes on at the velocity there.
    """

    def __init__(self, tolerance_s: float = 0.05, history: int = HISTORY) -> None:
        self._history = history
        self._tolerance_ns = round(NANOSECONDS * tolerance_s)
        self._moving: dict[str, list[StampedTransform]] = {}
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
        history = self._moving.setdefault(transform.child, [])
        if history and history[-1].stamp_ns - transform.stamp_ns >= BACKWARDS_NS:
            history.clear()
        k = len(history)
        while k and history[k - 1].stamp_ns > transform.stamp_ns:
            k -= 1  # It was overtaken on its way.
        if k and history[k - 1].stamp_ns == transform.stamp_ns:
            history[k - 1] = transform
            return
        history.insert(k, transform)
        del history[: -self._history]

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
        if 0 < k < len(stamps):
            before, after = history[k - 1], history[k]
            if stamps[k] - stamps[k - 1] > LONGEST_GAP_NS or before.parent != after.parent:
                return None
            return _between(before, after, stamp_ns)
        nearest = history[0] if k == 0 else history[-1]
        if abs(stamp_ns - nearest.stamp_ns) > self._tolerance_ns:
            return None
        other = _at_distance(history, nearest)
        return nearest if other is None else _between(nearest, other, stamp_ns)


def _at_distance(
    history: list[StampedTransform], nearest: StampedTransform
) -> StampedTransform | None:
    """Return a pose that tells the velocity at the first or last one; None where there is none."""
    ordered = history if nearest is history[0] else history[::-1]
    for one in ordered:
        apart_ns = abs(one.stamp_ns - nearest.stamp_ns)
        if apart_ns >= BASELINE_NS:
            near = apart_ns <= LONGEST_GAP_NS and one.parent == nearest.parent
            return one if near else None
    return None


def _between(a: StampedTransform, b: StampedTransform, stamp_ns: int) -> StampedTransform:
    """Return the pose at a stamp of a motion at constant velocity through two poses."""
    w = (stamp_ns - a.stamp_ns) / (b.stamp_ns - a.stamp_ns)
    R_parent_a = Rotation.from_matrix(a.T_parent_child[:3, :3])
    R_a_b = R_parent_a.inv() * Rotation.from_matrix(b.T_parent_child[:3, :3])
    rotation = (R_parent_a * Rotation.from_rotvec(w * R_a_b.as_rotvec())).as_matrix()
    translation = (1 - w) * a.T_parent_child[:3, 3] + w * b.T_parent_child[:3, 3]
    return StampedTransform(
        stamp_ns=stamp_ns,
        parent=a.parent,
        child=a.child,
        T_parent_child=make_transform(rotation, translation),
    )
