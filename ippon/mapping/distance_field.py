"""Exact Euclidean distance to occupied voxels, kept up to date in windows round what changed."""

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import OCCUPIED

LANES: Final = 16
FAR: Final = 1e6
"""Squared distance in voxels that stands for none."""
STALE: Final = 1


class DistanceField:
    """Updates `Pools.distance`: min(distance between voxel centres, distance_max) in metres.

    Distances of a block depend on occupied voxels up to `distance_max` away, so when voxels of a
    block become occupied, or cease to be, the blocks within that reach are computed again from the
    occupied voxels within reach of *them*, by a separable transform (exact; Saito and Toriwaki
    1994) over the box that holds them.
    """

    def __init__(self, voxel_size: float, distance_max: float) -> None:
        self._voxel_size = voxel_size
        self._distance_max = distance_max
        self._reach = int(np.ceil(distance_max / voxel_size))
        self._work: list[NDArray[np.float32]] = [np.empty(0, np.float32)] * 2

    def update(self, pools, directory, origin, changed, fresh) -> int:
        """Bring the field up to date.

        Args:
            pools: The map's `Pools`.
            directory: (DX, DY, DZ) rows by block.
            origin: (3,) block index of `directory[0, 0, 0]`.
            changed: (n, 3) blocks in which the occupied voxels changed.
            fresh: (m, 3) blocks that had no distances before.

        Returns:
            Number of voxels whose distance was computed.
        """
        if len(changed) == 0 and len(fresh) == 0:
            return 0
        reach_blocks = -(-self._reach // 8)
        parts = [fresh, fresh + 1] if len(fresh) else []
        if len(changed):
            parts += [changed - reach_blocks, changed + reach_blocks + 1]
        corners = np.concatenate(parts)
        low = np.maximum(corners.min(axis=0), origin)
        high = np.minimum(corners.max(axis=0), origin + directory.shape)
        if (high <= low).any():
            return 0
        shape = (high - low) * 8
        reach = self._reach
        depth = -(-int(shape[2]) // LANES) * LANES
        size = (int(shape[0]) + 2 * reach) * (int(shape[1]) + 2 * reach) * depth
        if self._work[0].size < size:
            self._work = [np.empty(size, np.float32) for _ in range(2)]
        nx, ny = int(shape[0]) + 2 * reach, int(shape[1]) + 2 * reach
        first = self._work[0][:size].reshape(nx, ny, depth)
        second = self._work[1][: nx * int(shape[1]) * depth].reshape(nx, int(shape[1]), depth)
        filled = np.zeros((nx, ny), np.uint8)
        _along_z_kernel(pools.state, directory, origin, low * 8, reach, first, filled)
        filled_y = np.zeros((nx, int(shape[1])), np.uint8)
        _along_y_kernel(first, filled, reach, second, filled_y)
        _along_x_kernel(
            second,
            filled_y,
            reach,
            low,
            directory,
            origin,
            np.float32(self._voxel_size),
            np.float32(self._distance_max),
            pools.distance,
        )
        return int(np.prod(shape))


@njit(cache=True, nogil=True)
def _along_z_kernel(state, directory, origin, low, reach, out, filled):
    """Squared distance along z within each column; `low` is the first voxel of the output box."""
    nx, ny, nz = out.shape
    far = np.float32(FAR)
    occupied = np.empty(nz + 2 * reach + 16, np.uint8)
    for x in range(nx):
        vx = low[0] - reach + x
        bx = (vx >> 3) - origin[0]
        for y in range(ny):
            vy = low[1] - reach + y
            by = (vy >> 3) - origin[1]
            any_occupied = False
            if 0 <= bx < directory.shape[0] and 0 <= by < directory.shape[1]:
                column = ((vx & 7) << 6) | ((vy & 7) << 3)
                first = low[2] - reach
                for bz in range((first >> 3), ((low[2] + nz + reach - 1) >> 3) + 1):
                    iz = bz - origin[2]
                    row = -1
                    if 0 <= iz < directory.shape[2]:
                        row = directory[bx, by, iz]
                    for k in range(8):
                        at = bz * 8 + k - first
                        if at < 0 or at >= nz + 2 * reach:
                            continue
                        hit = row >= 0 and state[row, column + k] == OCCUPIED
                        occupied[at] = hit
                        any_occupied = any_occupied or hit
            filled[x, y] = any_occupied
            if not any_occupied:
                continue
            last = -1000000
            for z in range(-reach, nz):
                if occupied[z + reach]:
                    last = z
                if z >= 0:
                    gap = np.float32(z - last)
                    out[x, y, z] = gap * gap if z - last <= reach else far
            last = 1000000
            for z in range(nz + reach - 1, -1, -1):
                if occupied[z + reach]:
                    last = z
                if z < nz and last - z <= reach:
                    gap = np.float32(last - z)
                    out[x, y, z] = min(out[x, y, z], gap * gap)


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz"})
def _greatest(line):
    top = np.float32(0.0)
    for z in range(line.shape[0]):
        top = max(top, line[z])
    return top


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz"})
def _lower(line, other, step):
    for z in range(line.shape[0]):
        line[z] = min(line[z], other[z] + step)


@njit(cache=True, nogil=True)
def _along_y_kernel(first, filled, reach, out, filled_out):
    nx, ny = out.shape[0], out.shape[1]
    far = np.float32(FAR)
    for x in range(nx):
        for y in range(ny):
            line = out[x, y]
            here = y + reach
            done = filled[x, here] == 1
            if done:
                line[:] = first[x, here]
            for d in range(1, reach + 1):
                step = np.float32(d * d)
                left, right = filled[x, here - d], filled[x, here + d]
                if left == 0 and right == 0:
                    continue
                if not done:
                    line[:] = far
                    done = True
                elif _greatest(line) <= step:
                    break
                if left:
                    _lower(line, first[x, here - d], step)
                if right:
                    _lower(line, first[x, here + d], step)
            filled_out[x, y] = done


@njit(cache=True, nogil=True)
def _along_x_kernel(
    second, filled, reach, low, directory, origin, voxel_size, distance_max, distance
):
    """Finish the transform and write the result to the blocks of the box."""
    nx, ny, nz = second.shape[0] - 2 * reach, second.shape[1], second.shape[2]
    far = np.float32(FAR)
    line = np.empty(nz, np.float32)
    height = directory.shape[2] - (low[2] - origin[2])
    for x in range(nx):
        bx = low[0] + (x >> 3) - origin[0]
        for y in range(ny):
            by = low[1] + (y >> 3) - origin[1]
            here = x + reach
            if filled[here, y]:
                line[:] = second[here, y]
            else:
                line[:] = far
            for d in range(1, reach + 1):
                step = np.float32(d * d)
                left, right = filled[here - d, y], filled[here + d, y]
                if left == 0 and right == 0:
                    continue
                if _greatest(line) <= step:
                    break
                if left:
                    _lower(line, second[here - d, y], step)
                if right:
                    _lower(line, second[here + d, y], step)
            for z in range(nz):
                line[z] = min(np.sqrt(line[z]) * voxel_size, distance_max)
            column = ((x & 7) << 6) | ((y & 7) << 3)
            for iz in range(min(nz >> 3, height)):
                row = directory[bx, by, low[2] - origin[2] + iz]
                if row >= 0:
                    for k in range(8):
                        distance[row, column + k] = line[iz * 8 + k]
