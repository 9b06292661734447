"""End of a search, and the cause of a failure."""

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
    "none", "wrong_instance", "false_stop", "out_of_reach", "collision", "stuck", "never_seen",
    "seen_and_missed", "time",
]  # fmt: skip
FAILURES: Final[tuple[Failure, ...]] = (
    "never_seen", "seen_and_missed", "false_stop", "wrong_instance", "out_of_reach", "collision",
    "stuck", "time",
)  # fmt: skip

STUCK_AFTER_S: Final = 60.0
STUCK_WITHIN_M: Final = 0.3
TOUCHED_BEFORE_S: Final = 5.0
"""Contact up to this long before the robot stopped counts as the cause of the stop."""
_SEEN_SHARE: Final = 0.0005
"""Share of the image that the object must fill to count as seen."""
_FIND_TOLERANCE_M: Final = 0.4


def shows_object(rendering: Rendering, instances: Sequence[int], max_range_m: float) -> bool:
    """Tell whether one of some instances fills enough of an image, within a range."""
    mine = np.isin(rendering.instance, instances)
    mine &= (rendering.depth > 0.0) & (rendering.depth <= max_range_m)
    return int(mine.sum()) >= max(1, math.ceil(_SEEN_SHARE * mine.size))


def is_at_instance(find: Find, instances: Sequence[Instance]) -> bool:
    """Tell whether a cluster of voxels lies on an instance, or within 0.4 m of one."""
    return any(_outside_m(find, one) <= _FIND_TOLERANCE_M for one in instances)


def is_wrong_instance(find: Find, right: Sequence[Instance], wrong: Sequence[Instance]) -> bool:
    """Tell whether a find lies on an instance of another colour, and no right one is nearer."""
    away = min((_outside_m(find, one) for one in wrong), default=math.inf)
    return away <= _FIND_TOLERANCE_M and away < min(
        (_outside_m(find, one) for one in right), default=math.inf
    )


def _outside_m(find: Find, instance: Instance) -> float:
    """Return the distance of a find's centre from the box of an instance."""
    p = np.array(find.position_world)
    outside = np.maximum(np.array(instance.aabb_min) - p, p - np.array(instance.aabb_max))
    return float(np.linalg.norm(np.maximum(outside, 0.0)))


def stood_still(positions: NDArray[np.float64], step_s: float) -> bool:
    """Tell whether a robot stayed in one place for the last minute.

    Args:
        positions: (N, 2) metres, one per frame.
        step_s: Seconds between frames.
    """
    frames = round(STUCK_AFTER_S / step_s)
    if len(positions) <= frames:
        return False
    last = positions[-frames:]
    return bool((np.linalg.norm(last - last[-1], axis=1) <= STUCK_WITHIN_M).all())


def touched_there(
    positions: NDArray[np.float64], contacts: NDArray[np.bool_], step_s: float
) -> bool:
    """Tell whether a robot touched an obstacle where it stands at the end, or just before.

    Args:
        positions: (N, 2) metres, one per frame.
        contacts: (N,) whether the base was in contact since the frame before.
        step_s: Seconds between frames.
    """
    away = np.flatnonzero(np.linalg.norm(positions - positions[-1], axis=1) > STUCK_WITHIN_M)
    arrived = int(away[-1]) + 1 if len(away) else 0
    return bool(contacts[max(0, arrived - round(TOUCHED_BEFORE_S / step_s)) :].any())


def failure_cause(
    *,
    success: bool,
    ending: Ending,
    seen: bool,
    recognised: bool,
    stuck: bool,
    touched: bool,
    wrong_instance: bool = False,
) -> Failure:
    """Return the cause of a failure; the first that applies.

    Args:
        success: Whether the search succeeded.
        ending: End of the search.
        seen: Whether the object was in an image, within mapping range.
        recognised: Whether the map holds a cluster of voxels at the object at the end.
        stuck: Whether the robot stood still for the last minute until time ran out.
        touched: Whether it was in contact where it stands.
        wrong_instance: Whether its find is of the goal's kind and has another colour.

    Returns:
        `wrong_instance`: the robot stopped at one of another colour. `false_stop`: the robot
        stopped where the object is not. `out_of_reach`: it reported the object without a path to
        it. `collision`: it was in contact and did not get away. `stuck`: it did not move, without
        contact. `never_seen`: the object never came into view. `time`: the map holds the object,
        and time ran out. `seen_and_missed`: the object came into view, and the search passed it.
    """
    if success:
        return "none"
    if ending == "found":
        return "wrong_instance" if wrong_instance else "false_stop"
    if ending == "out_of_reach":
        return "out_of_reach"
    if stuck:
        return "collision" if touched else "stuck"
    if not seen:
        return "never_seen"
    return "time" if recognised and ending == "time" else "seen_and_missed"
