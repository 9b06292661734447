"""Clusters of voxels that touch."""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ippon.geometry import Float64Array

_GAP: Final = 2.1
"""Largest distance between neighbours in a cluster, in voxel edges: one voxel may be missing."""


def clusters_of(centres: Float64Array, voxel_size: float) -> list[NDArray[np.intp]]:
    """Return the rows of each cluster of (M, 3) voxel centres, with one voxel of gap allowed."""
    count = len(centres)
    if count == 0:
        return []
    pairs = KDTree(centres).query_pairs(_GAP * voxel_size, output_type="ndarray")
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), (count, count))
    _, member_of = connected_components(graph, directed=False)
    ends = np.cumsum(np.bincount(member_of))
    return np.split(np.argsort(member_of, kind="stable"), ends[:-1])
