"""How a search ended, and why one failed."""

import math
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ippon.mission.snapshot import Find
from ippon.simulation.camera.renderer import Rendering
from ippon.simulation.scene import Instance

Ending = Literal["found", "out_of_reach", "exhausted", "time"]
Failure = Literal[
    "none", "false_stop", "out_of_reach", "collision", "stuck", "never_seen", "seen_and_missed",
    "time",
]  # fmt: skip
FAILURES: Final[tuple[Failure, ...]] = (
    "never_seen", "seen_and_missed", "false_stop", "out_of_reach", "collision", "stuck", "time",
)  # fmt: skip

STUCK_AFTER_S: Final = 60.0
STUCK_WITHIN_M: Final = 0.3
TOUCHED_BEFORE_S: Final = 5.0
"""A touch this long before the robot came to stand still still counts for what stopped it."""
_SEEN_SHARE: Final = 0.0005
"""Share of the image that the object must fill to count as seen."""
_FIND_TOLERANCE_M: Final = 0.4


def shows_object(rendering: Rendering, instances: Sequence[int], max_range_m: float) -> bool:
    """Tell whether one of some instances fills a noticeable part of an image, within a range."""
    mine = np.isin(rendering.instance, instances)
    mine &= (rendering.depth > 0.0) & (rendering.depth <= max_range_m)
    return int(mine.sum()) >= max(1, math.ceil(_SEEN_SHARE * mine.size))


def is_at_instance(find: Find, instances: Sequence[Instance]) -> bool:
    """Tell whether a cluster of voxels lies on one of some instances, or within 0.4 m of one."""
    p = np.array(find.position_world)
    for instance in instances:
        outside = np.maximum(
            np.maximum(np.array(instance.aabb_min) - p, p - np.array(instance.aabb_max)), 0.0
        )
        if float(np.linalg.norm(outside)) <= _FIND_TOLERANCE_M:
            return True
    return False


def stood_still(positions: NDArray[np.float64], step_s: float) -> bool:
    """Tell whether a robot stayed in one place for the last minute.

    Args:
        positions: (N, 2) metres, one a frame.
        step_s: Seconds between them.
    """
    frames = round(STUCK_AFTER_S / step_s)
    if len(positions) <= frames:
        return False
    last = positions[-frames:]
    return bool((np.linalg.norm(last - last[-1], axis=1) <= STUCK_WITHIN_M).all())


def touched_there(
    positions: NDArray[np.float64], contacts: NDArray[np.bool_], step_s: float
) -> bool:
    """Tell whether a robot touched something where it stands at the end, or just before.

    Args:
        positions: (N, 2) metres, one a frame.
        contacts: (N,) whether the base touched something since the frame before.
        step_s: Seconds between frames.
    """
    away = np.flatnonzero(np.linalg.norm(positions - positions[-1], axis=1) > STUCK_WITHIN_M)
    arrived = int(away[-1]) + 1 if len(away) else 0
    return bool(contacts[max(0, arrived - round(TOUCHED_BEFORE_S / step_s)) :].any())


def failure_cause(
    *, success: bool, ending: Ending, seen: bool, recognised: bool, stuck: bool, touched: bool
) -> Failure:
    """Name why a search failed; the first that applies.

    Args:
        success: It did not.
        ending: How it ended.
        seen: The object was in the image, near enough to be mapped.
        recognised: At the end, the map held a cluster of its voxels at the object.
        stuck: The robot had not moved for the last minute of an episode that ran out of time.
        touched: It touched something where it stands.

    Returns:
        `false_stop`: the robot said found where the object is not. `out_of_reach`: it said
        that it sees the object and no way leads close to it. `collision`: it touched something
        and did not get away from there. `stuck`: it did not move, and touched nothing.
        `never_seen`: the object never came into view. `time`: the map shows it, and time ran out
        before the robot stood in front of it. `seen_and_missed`: it came into view, and the search
        went past it.
    """
    if success:
        return "none"
    if ending == "found":
        return "false_stop"
    if ending == "out_of_reach":
        return "out_of_reach"
    if stuck:
        return "collision" if touched else "stuck"
    if not seen:
        return "never_seen"
    return "time" if recognised and ending == "time" else "seen_and_missed"
