"""What can be seen from one place, in every direction at once (Sec. Node Evaluation)."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED, UNKNOWN, MapArrays
from ippon.planning.view_table import ViewTable
from ippon.planning.voxels import block_row


class LookCounts(NamedTuple):
    """How often the camera has really looked at a voxel without settling it.

    Dense over the band of layers that count, at voxel `origin`.
    """

    origin: NDArray[np.int64]
    """(3,) voxel index of element (0, 0, 0)."""
    unknown: NDArray[np.uint8]
    """(X, Y, Z) looks after which the voxel was still unknown."""
    surface: NDArray[np.uint8]
    """(X, Y, Z) looks at the voxel as a surface."""


class ViewRules(NamedTuple):
    """What a visible voxel counts, in the terms of eqs. (3) and (4)."""

    unknown_occupied: float
    """p_occ of an unknown voxel."""
    unknown_depth: float
    """Voxels of unknown space that a ray crosses before it ends."""
    unknown_looks: float
    """Looks after which an unknown voxel is believed to stay unknown: glass, or a dark hole."""
    surface_looks: float
    """Looks after which a surface voxel has nothing more to tell."""
    ooi_floor: float
    """p(v in O) up to which a voxel counts as background."""
    ooi_threshold: float
    """p_T: above it a voxel is an object voxel."""
    termination_range: float
    """Horizontal reach of N_T in voxels."""
    level_range: float
    """Range in voxels within which labelled voxels decide p_img."""


class Panorama(NamedTuple):
    """Sums per direction, pitch-major, before any orientation is chosen."""

    known: NDArray[np.float32]
    """(P, Y) sum of p(v in O) over visible voxels of V_O."""
    unknown: NDArray[np.float32]
    """(P, Y) sum of p_occ(v) over visible voxels outside V_O; times p_img it is their gain."""
    ooi: NDArray[np.float32]
    """(P, Y) object voxels of N_T."""
    levels: NDArray[np.int32]
    """(Y, 4) labelled voxels nearby by heading and level."""
    near: NDArray[np.int32]
    """(M, 4) voxel index and heading column of the labelled voxels that `levels` counts."""
    depth: NDArray[np.float32]
    """(P, Y) voxels until the ray hit something or ended; a hit is negative."""


def see(
    arrays: MapArrays,
    table: ViewTable,
    rules: ViewRules,
    looks: LookCounts,
    camera_voxel: tuple[int, int, int],
) -> Panorama:
    """Evaluate one viewpoint in every direction.

    Args:
        arrays: The map.
        table: Directions and offsets.
        rules: What a voxel counts.
        looks: What was looked at already.
        camera_voxel: Voxel that holds the camera.
    """
    shape = (table.pitch_bins, table.yaw_bins)
    out = Panorama(
        known=np.zeros(shape, dtype=np.float32),
        unknown=np.zeros(shape, dtype=np.float32),
        ooi=np.zeros(shape, dtype=np.float32),
        levels=np.zeros((table.yaw_bins, 4), dtype=np.int32),
        near=np.empty((4096, 4), dtype=np.int32),
        depth=np.empty(shape, dtype=np.float32),
    )
    camera = np.array(camera_voxel, dtype=np.int64)
    count = _see_kernel(arrays, table, rules, looks, camera, out)
    return out._replace(near=out.near[:count].copy())


@njit(cache=True, nogil=True)
def cast_ray(
    arrays: MapArrays,
    table: ViewTable,
    unknown_depth: float,
    cx: int,
    cy: int,
    cz: int,
    dx: float,
    dy: float,
    dz: float,
) -> float:
    """Follow a ray from the centre of a voxel through free and unknown space.

    Steps are as long as the distance field allows: an occupied voxel reaches less than one edge
    beyond what its centre's distance says, corners aside. Unobserved blocks are crossed in one.

    Returns:
        Length in voxels; negative when it ends at an occupied voxel.
    """
    px, py, pz = cx + 0.5, cy + 0.5, cz + 0.5
    t, hidden = 0.0, 0.0
    # The camera's own voxel and its neighbours cannot hold anything the camera stands in.
    t = 1.0
    low, high = cz + table.layer_low, cz + table.layer_high
    while t < table.range_voxels:
        i = math.floor(px + t * dx)
        j = math.floor(py + t * dy)
        k = math.floor(pz + t * dz)
        if (k < low and dz <= 0.0) or (k > high and dz >= 0.0):
            break
        row = block_row(arrays, i, j, k)
        if row < 0:
            step = 20.0
            if abs(dx) > 1e-9:
                edge = ((i >> 3) + (1 if dx > 0.0 else 0)) * 8
                step = min(step, (edge - px) / dx - t)
            if abs(dy) > 1e-9:
                edge = ((j >> 3) + (1 if dy > 0.0 else 0)) * 8
                step = min(step, (edge - py) / dy - t)
            if abs(dz) > 1e-9:
                edge = ((k >> 3) + (1 if dz > 0.0 else 0)) * 8
                step = min(step, (edge - pz) / dz - t)
            step = max(step, 0.0) + 1e-3
            hidden += step
        else:
            column = ((i & 7) << 6) | ((j & 7) << 3) | (k & 7)
            state = arrays.state[row, column]
            if state == OCCUPIED:
                return -t
            step = max(arrays.distance[row, column] / arrays.voxel_size - 1.0, 0.5)
            if state == UNKNOWN:
                hidden += step
        if hidden > unknown_depth:
            return min(t + step - (hidden - unknown_depth), table.range_voxels)
        t += step
    return min(t, table.range_voxels)


@njit(cache=True, nogil=True)
def _see_kernel(arrays, table, rules, looks, camera, out):
    cx, cy, cz = camera[0], camera[1], camera[2]
    ox, oy, oz = looks.origin[0], looks.origin[1], looks.origin[2]
    nx, ny, nz = looks.unknown.shape
    reach2 = rules.termination_range * rules.termination_range
    near = 0
    for p in range(table.pitch_bins):
        for y in range(table.yaw_bins):
            cell = p * table.yaw_bins + y
            ray = table.rays[cell]
            depth = cast_ray(arrays, table, rules.unknown_depth, cx, cy, cz, ray[0], ray[1], ray[2])
            out.depth[p, y] = depth
            # A surface is seen a voxel deep; space ends a voxel before it, so that the unknown
            # inside of a wall seen at a slant does not count.
            solid_end = (1.0 - depth) if depth < 0.0 else depth
            space_end = (-1.0 - depth) if depth < 0.0 else depth
            known, unknown, ooi = 0.0, 0.0, 0.0
            for n in range(table.start[cell], table.start[cell + 1]):
                far = table.range[n]
                if far > solid_end:
                    break
                i = cx + table.offset[n, 0]
                j = cy + table.offset[n, 1]
                k = cz + table.offset[n, 2]
                row = block_row(arrays, i, j, k)
                a, b, c = i - ox, j - oy, k - oz
                counted = a >= 0 and b >= 0 and c >= 0 and a < nx and b < ny and c < nz
                if row < 0:
                    if far <= space_end:
                        seen = float(looks.unknown[a, b, c]) if counted else 0.0
                        unknown += max(0.0, 1.0 - seen / rules.unknown_looks)
                    continue
                column = ((i & 7) << 6) | ((j & 7) << 3) | (k & 7)
                state = arrays.state[row, column]
                if state == FREE:
                    continue
                if state == UNKNOWN:
                    if far <= space_end:
                        seen = float(looks.unknown[a, b, c]) if counted else 0.0
                        unknown += max(0.0, 1.0 - seen / rules.unknown_looks)
                    continue
                seen = float(looks.surface[a, b, c]) if counted else 0.0
                fresh = max(0.0, 1.0 - seen / rules.surface_looks)
                code = arrays.ooi[row, column]
                if code == NOT_MAPPED:
                    unknown += fresh / rules.unknown_occupied
                else:
                    posterior = code / 254.0
                    if posterior > rules.ooi_floor:
                        known += posterior * fresh
                    if posterior > rules.ooi_threshold:
                        across = table.offset[n, 0] ** 2 + table.offset[n, 1] ** 2
                        if across <= reach2:
                            ooi += 1.0
                level = arrays.level[row, column]
                if level != NOT_MAPPED and far <= rules.level_range:
                    out.levels[y, level] += 1
                    if near < out.near.shape[0]:
                        out.near[near, 0] = i
                        out.near[near, 1] = j
                        out.near[near, 2] = k
                        out.near[near, 3] = y
                        near += 1
            out.known[p, y] = known
            out.unknown[p, y] = unknown * rules.unknown_occupied
            out.ooi[p, y] = ooi
    return near
