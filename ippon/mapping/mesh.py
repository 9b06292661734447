"""Triangle mesh of the surface, from a copy of the map, so that it can run on any thread."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skimage.measure import marching_cubes

from ippon.mapping.arrays import BLOCK_EDGE
from ippon.mapping.blocks import N_ROWS
from ippon.mapping.occupancy.free_space import TSDF_ONE
from ippon.mapping.voxel_map import VoxelMap

CHUNK_BLOCKS = 24
"""Edge in blocks of the cubes that are meshed at a time; larger needs more memory."""
UNSEEN_COLOR = 128


@dataclass(frozen=True, slots=True, kw_only=True)
class Mesh:
    """Triangles of the zero crossing of the signed distance."""

    vertices: NDArray[np.float32]
    """(V, 3) metres."""
    faces: NDArray[np.int32]
    """(F, 3) rows of `vertices`."""
    colors: NDArray[np.uint8]
    """(V, 3) RGB."""


@dataclass(frozen=True, slots=True)
class SignedDistances:
    """Copy of the data that the mesh is computed from."""

    voxel_size: float
    coord: NDArray[np.int64]
    """(B, 3) block index."""
    tsdf: NDArray[np.int16]
    """(B, 512)."""
    weight: NDArray[np.uint8]
    """(B, 512)."""
    color: NDArray[np.uint8]
    """(B, 512, 3), `UNSEEN_COLOR` where nothing is known."""


def copy_signed_distances(voxel_map: VoxelMap) -> SignedDistances:
    """Copy what the mesh needs; call it between frames."""
    pools, surface = voxel_map._pools, voxel_map.surface  # noqa: SLF001 - one package
    rows = np.flatnonzero(pools.used[: int(pools.tally[N_ROWS])])
    slot = pools.slot[pools.slab[rows]]
    color = surface.color[slot]
    color[slot == 0] = UNSEEN_COLOR
    return SignedDistances(
        voxel_map.config.voxel_size_m,
        pools.coord[rows].copy(),
        pools.tsdf[rows],
        pools.weight[rows],
        color,
    )


def extract_mesh(distances: SignedDistances) -> Mesh:
    """Mesh the surface where all eight voxels of a cell were observed (marching cubes)."""
    vertices = [np.empty((0, 3), np.float32)]
    faces = [np.empty((0, 3), np.int32)]
    colors = [np.empty((0, 3), np.uint8)]
    count = 0
    chunk_of = distances.coord // CHUNK_BLOCKS
    for chunk in np.unique(chunk_of, axis=0) if len(chunk_of) else chunk_of:
        part = _mesh_chunk(distances, chunk * CHUNK_BLOCKS)
        if part is None:
            continue
        vertices.append(part.vertices)
        faces.append(part.faces + count)
        colors.append(part.colors)
        count += len(part.vertices)
    return Mesh(
        vertices=np.concatenate(vertices),
        faces=np.concatenate(faces).astype(np.int32),
        colors=np.concatenate(colors),
    )


def _mesh_chunk(distances: SignedDistances, low: NDArray[np.int64]) -> Mesh | None:
    """Mesh the cells that begin in one chunk, with one layer of the next blocks to close seams."""
    inside = ((distances.coord >= low) & (distances.coord <= low + CHUNK_BLOCKS)).all(axis=1)
    rows = np.flatnonzero(inside)
    size = (distances.coord[rows].max(axis=0) - low + 1) * BLOCK_EDGE
    limit = CHUNK_BLOCKS * BLOCK_EDGE + 1
    volume = np.ones(size, np.float32)
    observed = np.zeros(size, bool)
    color = np.full((*size, 3), UNSEEN_COLOR, np.uint8)
    for row in rows:
        at = tuple(slice(8 * k, 8 * k + 8) for k in distances.coord[row] - low)
        volume[at] = distances.tsdf[row].reshape(8, 8, 8) * np.float32(1.0 / TSDF_ONE)
        observed[at] = distances.weight[row].reshape(8, 8, 8) > 0
        color[at] = distances.color[row].reshape(8, 8, 8, 3)
    volume, observed = volume[:limit, :limit, :limit], observed[:limit, :limit, :limit]
    if min(volume.shape) < 2:
        return None
    cells = observed.copy()
    for axis in range(3):
        # A cell counts when all its corners were observed; the mask names it by its last corner.
        before = np.roll(cells, 1, axis=axis)
        before[(slice(None),) * axis + (0,)] = False
        cells &= before
    if not cells.any() or not (volume.min() < 0.0 < volume.max()):
        return None
    try:
        points, faces, _, _ = marching_cubes(volume, 0.0, mask=cells)
    except (ValueError, RuntimeError):
        # No cell of the mask crosses zero.
        return None
    index = points + (low * BLOCK_EDGE) + 0.5
    return Mesh(
        vertices=(index * distances.voxel_size).astype(np.float32),
        faces=faces.astype(np.int32),
        colors=_colors_at(points, color),
    )


def _colors_at(points: NDArray[np.float32], color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return each vertex's colour from the two voxels around it, preferring one with a colour."""
    low = np.floor(points).astype(np.int64)
    high = np.minimum(np.ceil(points).astype(np.int64), np.array(color.shape[:3]) - 1)
    behind, before = color[tuple(low.T)], color[tuple(high.T)]
    unknown = (behind == UNSEEN_COLOR).all(axis=1)
    return np.where(unknown[:, None], before, behind)
