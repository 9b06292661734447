"""What a viewpoint sees, the slow way: every voxel of the ball asked one by one."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED, UNKNOWN, MapArrays
from ippon.planning.visibility.panorama import ViewField, ViewRules
from ippon.planning.visibility.view_table import Orientations, ViewTable
from tests.reference.planning_floor import state_of


def pool_of(arrays: MapArrays, i: int, j: int, k: int) -> tuple[int, int]:
    block = np.array([i // 8, j // 8, k // 8]) - arrays.origin_block
    if (block < 0).any() or (block >= arrays.directory.shape).any():
        return -1, 0
    return int(arrays.directory[tuple(block)]), (i % 8) * 64 + (j % 8) * 8 + k % 8


def ray_end(
    arrays: MapArrays, table: ViewTable, unknown_depth: float, camera: tuple[int, int, int], ray
) -> tuple[float, bool]:
    """Length of a ray in voxels and whether it ends at a surface."""
    centre = np.array(camera) + 0.5
    t, hidden = 1.0, 0.0
    while t < table.range_voxels:
        point = centre + t * ray
        i, j, k = (int(c) for c in np.floor(point))
        below = k < camera[2] + table.layer_low and ray[2] <= 0.0
        above = k > camera[2] + table.layer_high and ray[2] >= 0.0
        if below or above:
            return t, False
        row, column = pool_of(arrays, i, j, k)
        if row < 0:
            exits = [20.0]
            for axis, index in enumerate((i, j, k)):
                if abs(ray[axis]) > 1e-9:
                    edge = (index // 8 + (ray[axis] > 0.0)) * 8
                    exits.append((edge - centre[axis]) / ray[axis] - t)
            step = max(min(exits), 0.0) + 1e-3
            hidden += step
        else:
            state = arrays.state[row, column]
            if state == OCCUPIED:
                return t, True
            step = max(math.sqrt(float(arrays.squared_distance[row, column])) - 1.0, 0.5)
            if state == UNKNOWN:
                hidden += step
        if hidden > unknown_depth:
            return min(t + step - (hidden - unknown_depth), table.range_voxels), False
        t += step
    return table.range_voxels, False


def direction_of(table: ViewTable, offset: tuple[int, int, int]) -> tuple[int, int] | None:
    """Row and column of the direction that a voxel offset lies in; None outside the raster."""
    x, y, z = offset
    pitch = math.atan2(z, math.hypot(x, y))
    row = math.floor((pitch - table.pitch_low) / table.bin_rad)
    column = math.floor((math.atan2(y, x) % (2 * math.pi)) / table.bin_rad) % table.yaw_bins
    return (row, column) if 0 <= row < table.pitch_bins else None


def panorama(
    arrays: MapArrays,
    table: ViewTable,
    rules: ViewRules,
    field: ViewField,
    camera: tuple[int, int, int],
) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
    """Known, unknown, object and farther object sums by direction; levels by column and level."""
    known, unknown, ooi, behind = (np.zeros((table.pitch_bins, table.yaw_bins)) for _ in range(4))
    levels = np.zeros((table.yaw_bins, 4), dtype=int)
    ends: dict[tuple[int, int], tuple[float, bool]] = {}
    reach = math.floor(table.range_voxels)
    for x in range(-reach, reach + 1):
        for y in range(-reach, reach + 1):
            for z in range(max(table.layer_low, -reach), min(table.layer_high, reach) + 1):
                far = math.sqrt(x * x + y * y + z * z)
                at = direction_of(table, (x, y, z))
                if far == 0.0 or far > table.range_voxels or at is None:
                    continue
                row, column = at
                group = int(table.group[row])
                cast = column // group * group + group // 2
                if (row, cast) not in ends:
                    ray = table.rays[row * table.yaw_bins + cast]
                    ends[row, cast] = ray_end(arrays, table, rules.unknown_depth, camera, ray)
                end, hit = ends[row, cast]
                i, j, k = camera[0] + x, camera[1] + y, camera[2] + z
                state = state_of(arrays, i, j, k)
                element = tuple(np.array([i, j, k]) - field.origin)
                if state == FREE or far > (end + 1 if hit else end):
                    continue
                if state == UNKNOWN:
                    if far <= (end - 1 if hit else end):
                        images = field.unknown_views[element]
                        left = max(0.0, 1.0 - images / rules.unknown_views)
                        unknown[at] += rules.unknown_occupied * left
                    continue
                left = max(0.0, 1.0 - field.surface_views[element] / rules.surface_views)
                pool = pool_of(arrays, i, j, k)
                pool = int(arrays.slab[pool[0]]), pool[1]
                near = far <= rules.surface_range
                if arrays.ooi[pool] == NOT_MAPPED:
                    unknown[at] += left if near else 0.0
                else:
                    p = arrays.ooi[pool] / 254.0
                    known[at] += p * left if near and p > rules.ooi_floor else 0.0
                    beyond = math.hypot(x, y) - rules.termination_range
                    if p > rules.termination_threshold and beyond <= rules.termination_depth:
                        (ooi if beyond <= 0.0 else behind)[at] += 1
                level = arrays.level[pool]
                if level != NOT_MAPPED and far <= rules.level_range:
                    levels[column, level] += 1
    beside = rules.termination_depth_columns
    for column in range(table.yaw_bins):
        near = [(column + d) % table.yaw_bins for d in range(-beside, beside + 1)]
        if not ooi[:, near].any():
            behind[:, column] = 0
    return known, unknown, ooi, behind, levels


def window(image: NDArray, orientations: Orientations, a: int, b: int) -> float:
    """Sum of a (P, Y) image over what one candidate orientation shows."""
    total, columns = 0.0, image.shape[1]
    for row in range(image.shape[0]):
        half = min(int(orientations.half_width[b, row]), columns // 2 - 1)
        for d in range(-half, half + 1):
            total += image[row, (a * orientations.stride + d) % columns]
    return total
