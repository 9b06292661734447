"""Exact Euclidean distance to occupied voxels, updated in windows around changes.

The squared distance of a voxel is the least of dx^2 + dy^2 + dz^2 over occupied voxels, which one
pass along each axis finds (Saito and Toriwaki, 1994). Beyond the cut-off nothing is needed, so the
passes along x and z take the minimum over shifted copies of int16, in pieces that stay in the
cache: more operations than a lower envelope of parabolas, but all of them in vector registers.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import INNER, OCCUPIED
from ippon.mapping.blocks import N_ROWS, Pools

FAR: Final = 20000
"""Squared distance in voxels that stands for no obstacle; FAR + (MAX_REACH + 1)^2 fits in int16."""
MAX_REACH: Final = 110
PIECE_BLOCKS: Final = 40
"""Longest edge on the floor of a box that is computed at once: an image changes less at 5 cm. At
the memory limit blocks far from the robot are dropped, and the box around both can be the map."""


class DistanceField:
    """Updates `Pools.squared_distance`, cut off at `farthest`.

    Where voxels of a block become occupied or cease to be, the distances of every block within
    reach are computed again, from all occupied voxels within reach of those.
    """

    def __init__(self, voxel_size: float, distance_max: float) -> None:
        self._reach = int(np.ceil(distance_max / voxel_size))
        if self._reach > MAX_REACH:
            raise ValueError(
                f"distance_max_m / voxel_size_m may be at most {MAX_REACH}; got "
                f"{distance_max} / {voxel_size}"
            )
        # The least whole number that means `distance_max` or more.
        self.farthest = int(np.ceil((distance_max / voxel_size) ** 2 - 1e-9))
        self._extent: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None
        self._offsets = _offsets_in_reach(self._reach)
        self._work = np.empty(0, np.int16)

    def update(
        self,
        pools: Pools,
        directory: NDArray[np.int32],
        origin: NDArray[np.int64],
        changed: NDArray[np.int64],
        fresh: NDArray[np.int64],
    ) -> int:
        """Bring the field up to date.

        Args:
            pools: The map's pools.
            directory: (DX, DY, DZ) rows by block.
            origin: (3,) block index of `directory[0, 0, 0]`.
            changed: (n, 3) blocks in which the occupied voxels changed.
            fresh: (m, 3) blocks that had no distances before.

        Returns:
            Number of voxels whose distance was computed.
        """
        if len(changed) == 0 and len(fresh) == 0:
            return 0
        least, most = self._widen_extent(pools, fresh)
        margin = int(np.abs(self._offsets).max())
        corners = np.concatenate([changed - margin, changed + margin, fresh])
        low = np.maximum(corners.min(axis=0), least)
        high = np.minimum(corners.max(axis=0) + 1, most)
        if (high <= low).any():
            return 0
        stale = np.zeros(tuple(int(s) for s in high - low), np.uint8)
        _mark_kernel(changed - low, fresh - low, self._offsets, directory, low - origin, stale)
        for piece_low, piece in _pieces(low, stale):
            self._transform(pools, directory, origin, piece_low, piece, (least, most))
        return int(stale.sum()) * 512

    def _widen_extent(
        self, pools: Pools, fresh: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the box that encloses every block so far, from the new blocks alone."""
        if self._extent is None:
            n = int(pools.tally[N_ROWS])
            known = np.concatenate([pools.coord[:n][pools.used[:n] == 1], fresh])
            if len(known) == 0:
                return np.zeros(3, np.int64), np.zeros(3, np.int64)
            self._extent = known.min(axis=0), known.max(axis=0) + 1
        elif len(fresh):
            least, most = self._extent
            self._extent = (
                np.minimum(least, fresh.min(axis=0)),
                np.maximum(most, fresh.max(axis=0) + 1),
            )
        return self._extent

    def _transform(
        self,
        pools: Pools,
        directory: NDArray[np.int32],
        origin: NDArray[np.int64],
        low: NDArray[np.int64],
        stale: NDArray[np.uint8],
        extent: tuple[NDArray[np.int64], NDArray[np.int64]],
    ) -> None:
        """Compute the distances of the stale blocks of the box that starts at block `low`."""
        reach_blocks = -(-self._reach // 8)
        # The input box ends where the map does, since blocks outside are empty.
        read_low = np.maximum(low - reach_blocks, extent[0])
        read_high = np.minimum(low + stale.shape + reach_blocks, extent[1])
        nx, ny, nz = (int(s) * 8 for s in read_high - read_low)
        if self._work.size < nx * ny * nz:
            self._work = np.empty(nx * ny * nz * 5 // 4, np.int16)
        volume = self._work[: nx * ny * nz].reshape(nx, ny, nz)
        skip = (low - read_low) * 8
        _fill_kernel(pools, directory, read_low - origin, volume)
        _along_y_kernel(volume, self._reach, int(skip[1]), stale.shape[1] * 8)
        lines = np.full((3, 8 * nz + 16 * (self._reach + 1)), FAR, np.int16)
        _along_xz_kernel(
            volume,
            lines,
            self._reach,
            skip,
            stale,
            directory,
            low - origin,
            np.int16(self.farthest),
            pools.squared_distance,
        )


def _offsets_in_reach(reach: int) -> NDArray[np.int64]:
    """Return (K, 3) differences of block indices between which voxels can be within reach."""
    n = -(-reach // 8)
    steps = np.arange(-n, n + 1)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    gap = np.where(grid == 0, 0, (np.abs(grid) - 1) * 8 + 1)
    return grid[(gap**2).sum(axis=1) <= reach**2].astype(np.int64)


def _pieces(
    low: NDArray[np.int64], stale: NDArray[np.uint8]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.uint8]]]:
    """Cut the box that starts at block `low` into pieces, each as small as its stale blocks."""
    for x in range(0, stale.shape[0], PIECE_BLOCKS):
        for y in range(0, stale.shape[1], PIECE_BLOCKS):
            piece = stale[x : x + PIECE_BLOCKS, y : y + PIECE_BLOCKS]
            at = np.argwhere(piece)
            if len(at):
                first, last = at.min(axis=0), at.max(axis=0) + 1
                cut = piece[tuple(slice(a, b) for a, b in zip(first, last, strict=True))]
                yield low + first + np.array([x, y, 0]), np.ascontiguousarray(cut)


@njit(cache=True, nogil=True)
def _mark_kernel(changed, fresh, offsets, directory, shift, stale):
    """Mark the blocks whose distances may have changed; block indices count from the box."""
    for n in range(fresh.shape[0]):
        stale[fresh[n, 0], fresh[n, 1], fresh[n, 2]] = 1
    for n in range(changed.shape[0]):
        for m in range(offsets.shape[0]):
            x = changed[n, 0] + offsets[m, 0]
            y = changed[n, 1] + offsets[m, 1]
            z = changed[n, 2] + offsets[m, 2]
            if not (
                0 <= x < stale.shape[0] and 0 <= y < stale.shape[1] and 0 <= z < stale.shape[2]
            ):
                continue
            if directory[x + shift[0], y + shift[1], z + shift[2]] >= 0:
                stale[x, y, z] = 1


@njit(cache=True, nogil=True)
def _fill_kernel(pools, directory, shift, volume):
    """Write 0 for occupied and FAR for other voxels of the box of blocks that begins at `shift`."""
    volume[:] = np.int16(FAR)
    for bx in range(volume.shape[0] >> 3):
        for by in range(volume.shape[1] >> 3):
            for bz in range(volume.shape[2] >> 3):
                row = directory[bx + shift[0], by + shift[1], bz + shift[2]]
                if row < 0 or pools.occupied[row] == 0:
                    continue
                state = pools.state[row]
                for i in range(8):
                    for j in range(8):
                        line = volume[bx * 8 + i, by * 8 + j]
                        for k in range(8):
                            occupied = state[(i << 6) | (j << 3) | k] == OCCUPIED
                            line[bz * 8 + k] = np.int16(0) if occupied else np.int16(FAR)


@njit(cache=True, nogil=True)
def _along_y_kernel(volume, reach, first, rows):
    """Turn each line along y into squared distances, in place, for rows first .. first + rows."""
    nx, ny, length = volume.shape
    one, far = np.int16(1), np.int16(FAR)
    for x in range(nx):
        plane = volume[x]
        for y in range(1, min(ny, first + rows)):
            for z in range(length):
                step = np.int16(plane[y - 1, z] + one)
                plane[y, z] = min(plane[y, z], step)
        for y in range(ny - 2, first - 1, -1):
            for z in range(length):
                step = np.int16(plane[y + 1, z] + one)
                plane[y, z] = min(plane[y, z], step)
        for y in range(first, min(ny, first + rows)):
            for z in range(length):
                d = plane[y, z]
                plane[y, z] = np.int16(d * d) if d <= reach else far


@INNER
def _lower(line, a, b, c, d, step, next_step):
    """Take the least of `line`, `a` and `b` plus `step`, and `c` and `d` plus `next_step`.

    Element by element; with two steps at once `line` is loaded and stored half as often.
    """
    for n in range(line.shape[0]):
        near = np.int16(min(a[n], b[n]) + step)
        far = np.int16(min(c[n], d[n]) + next_step)
        line[n] = min(line[n], near, far)


@njit(cache=True, nogil=True)
def _along_xz_kernel(volume, lines, reach, skip, stale, directory, shift, farthest, out):
    """Finish the transform and write the distances of the stale blocks; `lines` is working memory.

    Eight lines along z at a time, one of each y of a block, which stay in the cache.
    """
    nx, ny, nz = volume.shape
    planes = volume.reshape(nx, ny * nz)
    along_x, least = lines[0, : 8 * nz], lines[1, : 8 * nz]
    # Transposed: the eight values of a z stand together. Shifts along z run into FAR at both ends.
    rim = 8 * (reach + 1)
    turned = lines[2]
    for bx in range(stale.shape[0]):
        for by in range(stale.shape[1]):
            first, last = stale.shape[2], -1
            for bz in range(stale.shape[2]):
                if stale[bx, by, bz]:
                    first, last = min(first, bz), bz
            if last < 0:
                continue
            begin = (skip[1] + by * 8) * nz
            end = begin + 8 * nz
            low, high = 8 * (skip[2] + first * 8), 8 * (skip[2] + last * 8 + 8)
            for i in range(8):
                here = bx * 8 + i + skip[0]
                for n in range(8 * nz):
                    along_x[n] = planes[here, begin + n]
                for d in range(1, reach + 1, 2):
                    # The last plane stands for those beyond it: at its own distance it is less.
                    _lower(
                        along_x,
                        planes[max(0, here - d), begin:end],
                        planes[min(nx - 1, here + d), begin:end],
                        planes[max(0, here - d - 1), begin:end],
                        planes[min(nx - 1, here + d + 1), begin:end],
                        np.int16(d * d),
                        np.int16((d + 1) * (d + 1)),
                    )
                for k in range(nz):
                    for j in range(8):
                        turned[rim + 8 * k + j] = along_x[j * nz + k]
                line = least[: high - low]
                for n in range(high - low):
                    line[n] = turned[rim + low + n]
                at, to = rim + low, rim + high
                for d in range(1, reach + 1, 2):
                    _lower(
                        line,
                        turned[at - 8 * d : to - 8 * d],
                        turned[at + 8 * d : to + 8 * d],
                        turned[at - 8 * d - 8 : to - 8 * d - 8],
                        turned[at + 8 * d + 8 : to + 8 * d + 8],
                        np.int16(d * d),
                        np.int16((d + 1) * (d + 1)),
                    )
                for bz in range(first, last + 1):
                    if stale[bx, by, bz] == 0:
                        continue
                    row = directory[bx + shift[0], by + shift[1], bz + shift[2]]
                    of = 64 * (bz - first)
                    for j in range(8):
                        for k in range(8):
                            squared = min(line[of + 8 * k + j], farthest)
                            out[row, (i << 6) | (j << 3) | k] = np.uint16(squared)
