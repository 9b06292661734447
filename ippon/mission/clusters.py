"""Clusters of voxels that are probably the object."""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, invert_transform, transform_points
from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME, NOT_MAPPED, OCCUPIED, MapArrays
from ippon.mission.snapshot import Find


class OoiVoxels:
    """Keeps count, block by block, of the occupied voxels above p_T; cost follows the change."""

    def __init__(self, threshold: float) -> None:
        self._threshold = round(threshold * 254.0)
        self._counts = np.zeros(0, dtype=np.int32)
        self._revision = -1

    def update(self, arrays: MapArrays) -> tuple[Float64Array, NDArray[np.float64]]:
        """Return centres (M, 3) in metres and p(v in O) (M,) of the voxels above the threshold."""
        rows = arrays.revision.shape[0]
        if rows > self._counts.shape[0]:
            self._counts = np.concatenate(
                [self._counts, np.zeros(rows - self._counts.shape[0], dtype=np.int32)]
            )
        total = _count_kernel(
            arrays.state,
            arrays.slab,
            arrays.ooi,
            arrays.revision,
            self._revision,
            self._threshold,
            self._counts,
        )
        self._revision = int(arrays.revision.max(initial=-1))
        index = np.empty((total, 3), dtype=np.int64)
        value = np.empty(total, dtype=np.uint8)
        _gather_kernel(
            arrays.directory,
            arrays.origin_block,
            arrays.state,
            arrays.slab,
            arrays.ooi,
            self._counts,
            self._threshold,
            index,
            value,
        )
        centres: Float64Array = (index.astype(np.float64) + 0.5) * arrays.voxel_size
        return centres, value.astype(np.float64) / 254.0

    def forget(self) -> None:
        """Count every block again at the next update: the object changed."""
        self._revision = -1


@njit(cache=True, nogil=True)
def _count_kernel(state, slab, ooi, revision, since, threshold, counts):
    total = 0
    for row in range(revision.shape[0]):
        if revision[row] > since:
            n, codes = 0, ooi[slab[row]]
            for c in range(BLOCK_VOLUME):
                if state[row, c] == OCCUPIED and threshold < codes[c] < NOT_MAPPED:
                    n += 1
            counts[row] = n
        total += counts[row]
    return total


@njit(cache=True, nogil=True)
def _gather_kernel(directory, origin_block, state, slab, ooi, counts, threshold, index, value):
    m = 0
    for bx in range(directory.shape[0]):
        for by in range(directory.shape[1]):
            for bz in range(directory.shape[2]):
                row = directory[bx, by, bz]
                if row < 0 or counts[row] == 0:
                    continue
                codes = ooi[slab[row]]
                for c in range(BLOCK_VOLUME):
                    if state[row, c] == OCCUPIED and threshold < codes[c] < NOT_MAPPED:
                        index[m, 0] = (origin_block[0] + bx) * BLOCK_EDGE + c // 64
                        index[m, 1] = (origin_block[1] + by) * BLOCK_EDGE + (c // 8) % 8
                        index[m, 2] = (origin_block[2] + bz) * BLOCK_EDGE + c % 8
                        value[m] = codes[c]
                        m += 1


def cluster_finds(
    centres_world: Float64Array,
    probabilities: NDArray[np.float64],
    voxel_size: float,
    *,
    camera: PinholeCamera,
    T_world_camera: Float64Array,
) -> tuple[Find, ...]:
    """Join voxels that touch (one voxel of gap allowed) into finds, most voxels first.

    Args:
        centres_world: (M, 3) metres.
        probabilities: (M,) p(v in O).
        voxel_size: Edge of a voxel, metres.
        camera: Intrinsics of the present colour image.
        T_world_camera: Its pose.
    """
    if centres_world.shape[0] == 0:
        return ()
    pairs = KDTree(centres_world).query_pairs(2.1 * voxel_size, output_type="ndarray")
    count = centres_world.shape[0]
    graph = coo_array(
        (np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), (count, count)
    )
    clusters, member_of = connected_components(graph, directed=False)
    finds = [
        _find_of(
            centres_world[member_of == c],
            probabilities[member_of == c],
            voxel_size,
            camera,
            T_world_camera,
        )
        for c in range(clusters)
    ]
    return tuple(sorted(finds, key=lambda find: -find.voxels))


def _find_of(
    centres: Float64Array,
    probabilities: NDArray[np.float64],
    voxel_size: float,
    camera: PinholeCamera,
    T_world_camera: Float64Array,
) -> Find:
    low, high = centres.min(axis=0) - 0.5 * voxel_size, centres.max(axis=0) + 0.5 * voxel_size
    centroid = centres.mean(axis=0)
    x, y, z = (float(c) for c in centroid)
    sx, sy, sz = (float(s) for s in high - low)
    return Find(
        position_world=(x, y, z),
        size_m=(sx, sy, sz),
        probability=float(probabilities.mean()),
        voxels=int(centres.shape[0]),
        box_px=project_box(centres, voxel_size, camera, T_world_camera),
    )


def project_box(
    centres_world: Float64Array,
    voxel_size: float,
    camera: PinholeCamera,
    T_world_camera: Float64Array,
) -> tuple[int, int, int, int] | None:
    """Return the pixel box (u0, v0, u1, v1) round voxels, None when none of them is in view."""
    points = transform_points(invert_transform(T_world_camera), centres_world)
    points = points[points[:, 2] > 0.1]
    u, v = camera.project(points)
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    if not inside.any():
        return None
    margin = 0.5 * voxel_size * camera.fx / points[inside, 2]
    u0 = max(0, int((u[inside] - margin).min()))
    v0 = max(0, int((v[inside] - margin).min()))
    u1 = min(camera.width - 1, int((u[inside] + margin).max()))
    v1 = min(camera.height - 1, int((v[inside] + margin).max()))
    return u0, v0, u1, v1
