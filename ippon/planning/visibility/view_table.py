"""The voxels around a viewpoint, sorted by the direction in which they lie."""

import functools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.robot import RobotProfile


class ViewTable(NamedTuple):
    """Directions in a yaw x pitch raster, and the voxel offsets that fall into each.

    Offsets are relative to the voxel that holds the camera; every voxel within range and height
    lies in exactly one direction, so that a pass over directions counts it once.
    """

    yaw_bins: int
    pitch_bins: int
    pitch_low: float
    """Pitch of the lower edge of row 0, radians."""
    bin_rad: float
    """Edge of a direction cell in radians, in yaw and in pitch."""
    range_voxels: float
    layer_low: int
    """Lowest layer that counts, relative to the camera's voxel."""
    layer_high: int
    group: NDArray[np.int64]
    """(P,) neighbouring columns of each row that share a ray: towards the nadir and the zenith
    columns crowd together, and one ray serves several."""
    rays: NDArray[np.float64]
    """(P * Y, 3) unit directions of the cells' centres, pitch-major."""
    start: NDArray[np.int64]
    """(P * Y + 1,) first row of each direction in the arrays below."""
    offset: NDArray[np.int16]
    """(M, 3) voxel offsets, nearest first within a direction."""
    range: NDArray[np.float32]
    """(M,) length of the offset in voxels."""


# Every search with one robot has the same table, which takes a tenth of a second.
@functools.lru_cache(maxsize=1)
def build_view_table(
    *,
    yaw_bins: int,
    pitch_low: float,
    pitch_high: float,
    range_voxels: float,
    layer_low: int,
    layer_high: int,
) -> ViewTable:
    """Sort all voxel offsets within range into directions.

    Args:
        yaw_bins: Directions around the horizon; cells are square, so it sets the pitch too.
        pitch_low: Lowest pitch that the camera can show, radians.
        pitch_high: Highest such pitch.
        range_voxels: Range of the camera in voxels.
        layer_low: Lowest layer that counts, relative to the camera's voxel.
        layer_high: Highest layer that counts.
    """
    step = 2.0 * math.pi / yaw_bins
    pitch_bins = max(1, math.ceil((pitch_high - pitch_low) / step - 1e-9))
    reach = math.floor(range_voxels)
    axis = np.arange(-reach, reach + 1)
    layers = np.arange(max(layer_low, -reach), min(layer_high, reach) + 1)
    x, y, z = (a.ravel() for a in np.meshgrid(axis, axis, layers, indexing="ij"))
    length = np.sqrt((x * x + y * y + z * z).astype(np.float64))
    yaw = np.floor((np.arctan2(y, x) % (2.0 * math.pi)) / step).astype(np.int64) % yaw_bins
    pitch = np.arctan2(z, np.hypot(x, y))
    row = np.floor((pitch - pitch_low) / step).astype(np.int64)
    keep = (length <= range_voxels) & (length > 0.0) & (row >= 0) & (row < pitch_bins)
    direction = (row * yaw_bins + yaw)[keep]
    offset = np.stack([x, y, z], axis=1)[keep]
    order = np.lexsort((offset[:, 2], offset[:, 1], offset[:, 0], length[keep], direction))
    counts = np.bincount(direction, minlength=pitch_bins * yaw_bins)
    centre_yaw = (np.arange(yaw_bins) + 0.5) * step
    centre_pitch = pitch_low + (np.arange(pitch_bins, dtype=np.float64) + 0.5) * step
    cp, sp = np.cos(centre_pitch)[:, None], np.sin(centre_pitch)[:, None]
    rays = np.stack(
        [cp * np.cos(centre_yaw), cp * np.sin(centre_yaw), sp + 0.0 * centre_yaw], axis=2
    )
    return ViewTable(
        yaw_bins=yaw_bins,
        pitch_bins=pitch_bins,
        pitch_low=pitch_low,
        bin_rad=step,
        range_voxels=float(range_voxels),
        layer_low=int(layer_low),
        layer_high=int(layer_high),
        group=_columns_per_ray(centre_pitch, yaw_bins),
        rays=np.ascontiguousarray(rays.reshape(-1, 3), dtype=np.float64),
        start=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        offset=np.ascontiguousarray(offset[order].astype(np.int16)),
        range=np.ascontiguousarray(length[keep][order].astype(np.float32)),
    )


def _columns_per_ray(pitch: NDArray[Any], yaw_bins: int) -> NDArray[np.int64]:
    """Return the largest power of two that divides `yaw_bins` and keeps rays a cell apart."""
    wanted = np.clip(1.0 / np.maximum(np.cos(pitch), 1e-9), 1.0, 4.0)
    group = np.power(2, np.floor(np.log2(wanted) + 0.3).astype(np.int64))
    return np.minimum(group, math.gcd(yaw_bins, 4))


def in_frustum(
    rays: Float64Array, robot: RobotProfile, yaw: float, tilt: float, shrink: float = 1.0
) -> NDArray[np.bool_]:
    """Return which directions the camera shows at one yaw and tilt.

    Args:
        rays: (N, 3) directions in the world frame.
        robot: The camera's field of view.
        yaw: Heading, radians.
        tilt: Camera tilt, positive up.
        shrink: Scale of the tangent of the half angles; below 1 leaves the border out.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    ahead = rays[:, 0] * c + rays[:, 1] * s
    left = rays[:, 1] * c - rays[:, 0] * s
    ct, st = math.cos(tilt), math.sin(tilt)
    depth = ahead * ct + rays[:, 2] * st
    up = rays[:, 2] * ct - ahead * st
    wide = math.tan(0.5 * robot.horizontal_fov_rad) * shrink
    high = math.tan(0.5 * robot.vertical_fov_rad) * shrink
    return (depth > 0.0) & (np.abs(left) <= wide * depth) & (np.abs(up) <= high * depth)


class Orientations(NamedTuple):
    """Candidate headings and tilts of a viewpoint, and what each shows of the raster."""

    yaws: NDArray[np.float64]
    """(A,) candidate headings, radians, evenly spaced."""
    tilts: NDArray[np.float64]
    """(B,) candidate tilts, radians."""
    half_width: NDArray[np.int64]
    """(B, P) cells that a tilt shows on either side of the heading's own, -1 for none."""
    stride: int
    """Raster columns from one candidate heading to the next."""


def build_orientations(
    table: ViewTable, robot: RobotProfile, stride: int, tilts: int
) -> Orientations:
    """Work out which cells of the raster each candidate orientation shows.

    A tilted pinhole image is no rectangle in yaw and pitch: rows near the nadir are wider.
    """
    tilts = tilts if robot.can_tilt else 1
    values = np.linspace(robot.min_tilt_rad, robot.max_tilt_rad, tilts)
    # Headings lie on the centres of raster columns; column 0's is half a cell off the x axis.
    heading = 0.5 * table.bin_rad
    half = np.full((tilts, table.pitch_bins), -1, dtype=np.int64)
    for b, tilt in enumerate(values):
        shown = in_frustum(table.rays, robot, heading, float(tilt))
        raster = shown.reshape(table.pitch_bins, table.yaw_bins)
        reach = table.yaw_bins // 2
        for row in range(table.pitch_bins):
            if raster[row, 0]:
                run = np.flatnonzero(~raster[row, : reach + 1])
                half[b, row] = (run[0] if run.size else reach) - 1
    columns = np.arange(0, table.yaw_bins, stride)
    return Orientations(
        yaws=np.asarray((columns + 0.5) * table.bin_rad, dtype=np.float64),
        tilts=values,
        half_width=half,
        stride=stride,
    )
