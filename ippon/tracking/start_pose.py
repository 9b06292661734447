"""The pose of the first frame of a camera that knows none: upright, above the floor in view."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ippon.errors import IpponError
from ippon.geometry import R_BASE_CAMERA_LEVEL, Float64Array, make_transform, rotation_y
from ippon.tracking.depth_points import SurfacePoints

MOST_TILTED_RAD: Final = math.radians(35.0)
"""Error of the assumed direction of up that is corrected."""
LEVEL_RAD: Final = math.radians(8.0)
"""Angle to up within which a normal is that of level surface."""
_ROUNDS: Final = 6
SLAB_M: Final = 0.06
"""Thickness of a layer of level surface."""
LEAST_SHARE: Final = 0.02
"""Share of the points that must lie on the floor."""
CAMERA_OFF_M: Final = 0.5
"""Difference between the assumed and the true height of the camera that is accepted."""


class NoFloorError(IpponError):
    """No floor is in view; the text says what would help."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AssumedMount:
    """How the camera is held, roughly."""

    height_m: float
    """Above the floor."""
    tilt_rad: float
    """Positive is up."""


def start_pose(seen: SurfacePoints, mount: AssumedMount) -> Float64Array:
    """Return T_world_camera: z up, the floor at 0, the camera above the origin, heading along x.

    Args:
        seen: Points of the first frame, camera frame.
        mount: How the camera is held; the error may be half a metre and 35 degrees.

    Raises:
        NoFloorError: No level surface lies about as far below the camera as is assumed.
    """
    assumed = rotation_y(-mount.tilt_rad) @ R_BASE_CAMERA_LEVEL
    up = assumed[2]
    reach = MOST_TILTED_RAD
    for _ in range(_ROUNDS):
        level = seen.normals @ up > math.cos(reach)
        if np.count_nonzero(level) < max(1.0, LEAST_SHARE * len(seen)):
            raise _no_floor(mount)
        mean = seen.normals[level].mean(axis=0)
        up, reach = mean / np.linalg.norm(mean), max(0.6 * reach, LEVEL_RAD)
    heights = seen.points[seen.normals @ up > math.cos(LEVEL_RAD)] @ up
    floor_m = _lowest_layer(heights, LEAST_SHARE * len(seen))
    if floor_m is None or abs(-floor_m - mount.height_m) > CAMERA_OFF_M:
        raise _no_floor(mount)
    ahead = np.array([0.0, 0.0, 1.0]) - up[2] * up
    if np.linalg.norm(ahead) < 1e-3:
        # The camera looks straight down: the upper edge of the image points ahead.
        ahead = np.array([0.0, -1.0, 0.0]) + up[1] * up
    ahead /= np.linalg.norm(ahead)
    return make_transform(np.stack([ahead, np.cross(up, ahead), up]), (0.0, 0.0, -floor_m))


def _lowest_layer(heights: Float64Array, least: float) -> float | None:
    """Return the height of the lowest layer with enough points; None for none."""
    if len(heights) == 0:
        return None
    low = float(heights.min())
    counts = np.bincount(((heights - low) / SLAB_M).astype(np.int64))
    together = counts + np.append(counts[1:], 0)
    enough = np.flatnonzero(together >= least)
    if not len(enough):
        return None
    bottom = low + SLAB_M * int(enough[0])
    layer = heights[(heights >= bottom) & (heights < bottom + 2.0 * SLAB_M)]
    return float(np.median(layer))


def _no_floor(mount: AssumedMount) -> NoFloorError:
    return NoFloorError(
        "no floor is in view, from which to begin: hold the camera upright, about "
        f"{mount.height_m:.1f} m high, so that its image shows a metre or two of floor"
    )
