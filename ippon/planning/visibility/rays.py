"""Ray casting through free and unknown space, many rays at a time."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.mapping.arrays import OCCUPIED, UNKNOWN, MapArrays
from ippon.planning.visibility.view_table import ViewTable
from ippon.planning.voxel_lookup import block_row, voxel_column


def cast_ray(
    arrays: MapArrays,
    table: ViewTable,
    unknown_depth: float,
    camera_voxel: tuple[int, int, int],
    direction: Float64Array,
) -> float:
    """Cast one ray from the centre of a voxel.

    Args:
        arrays: The map.
        table: Range and layers.
        unknown_depth: Voxels of unknown space that the ray crosses before it ends.
        camera_voxel: Voxel that it starts from.
        direction: (3,) unit vector.

    Returns:
        Length in voxels; negative when it ends at an occupied voxel.
    """
    depth = np.empty(1)
    directions = np.ascontiguousarray(direction, dtype=np.float64).reshape(1, 3)
    camera = np.array(camera_voxel, dtype=np.int64)
    cast_rays_kernel(arrays, table, unknown_depth, camera, directions, np.zeros(1, np.int64), depth)
    return float(depth[0])


def cast_rays(
    arrays: MapArrays,
    table: ViewTable,
    unknown_depth: float,
    camera: NDArray[np.int64],
    cells: NDArray[np.int64],
) -> Float64Array:
    """Cast the rays of some cells of the raster from the centre of voxel `camera` (3,).

    Args:
        arrays: The map.
        table: Rays, range and layers.
        unknown_depth: Voxels of unknown space that a ray crosses before it ends.
        camera: Voxel that holds the camera.
        cells: (N,) rows of `table.rays`.

    Returns:
        (N,) lengths in voxels; negative for those that end at an occupied voxel.
    """
    depth = np.empty(len(cells))
    cast_rays_kernel(arrays, table, unknown_depth, camera, table.rays, cells, depth)
    return depth


@njit(allocates=True, cache=True, nogil=True, error_model="numpy")
def cast_rays_kernel(arrays, table, unknown_depth, camera, directions, cells, depth):
    """Write the length of the ray `directions[cells[n]]` into `depth[n]`, negative for a hit.

    The distance field gives the length of each step: apart from its corners, an occupied voxel
    extends less than one edge from its centre. An unobserved block is crossed in one step.

    Each step of a ray depends on a value that the step before has loaded. Therefore all rays of a
    batch advance together, step by step, so that the processor can overlap their loads.
    """
    batch = 256
    px, py, pz = camera[0] + 0.5, camera[1] + 0.5, camera[2] + 0.5
    low, high = camera[2] + table.layer_low, camera[2] + table.layer_high
    reach = table.range_voxels
    rays = np.empty(batch, dtype=np.int64)
    travelled, crossed = np.empty(batch), np.empty(batch)
    for first in range(0, cells.shape[0], batch):
        going = 0
        for r in range(first, min(first + batch, cells.shape[0])):
            # Rays begin one voxel from the camera: its own voxel must be free.
            rays[going], travelled[going], crossed[going] = r, 1.0, 0.0
            going += 1
        while going > 0:
            left = 0
            for m in range(going):
                r, t, hidden = rays[m], travelled[m], crossed[m]
                if t >= reach:
                    depth[r] = reach
                    continue
                cell = cells[r]
                dx, dy, dz = directions[cell, 0], directions[cell, 1], directions[cell, 2]
                i = math.floor(px + t * dx)
                j = math.floor(py + t * dy)
                k = math.floor(pz + t * dz)
                if (k < low and dz <= 0.0) or (k > high and dz >= 0.0):
                    depth[r] = t
                    continue
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
                    column = voxel_column(i, j, k)
                    state = arrays.state[row, column]
                    if state == OCCUPIED:
                        depth[r] = -t
                        continue
                    step = max(np.sqrt(float(arrays.squared_distance[row, column])) - 1.0, 0.5)
                    hidden += step if state == UNKNOWN else 0.0
                if hidden > unknown_depth:
                    depth[r] = min(t + step - (hidden - unknown_depth), reach)
                    continue
                rays[left], travelled[left], crossed[left] = r, t + step, hidden
                left += 1
            going = left
