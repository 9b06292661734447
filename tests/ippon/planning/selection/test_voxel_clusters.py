"""Clusters of voxels."""

import numpy as np

from ippon.planning.selection.voxel_clusters import clusters_of


def test_voxels_with_one_between_them_are_one_cluster():
    voxels = np.array([[0.25, 0.05, 0.05], [0.65, 0.05, 0.05], [0.05, 0.05, 0.05]])
    assert [rows.tolist() for rows in clusters_of(voxels, 0.1)] == [[0, 2], [1]]


def test_no_voxels_are_no_cluster():
    assert clusters_of(np.zeros((0, 3)), 0.1) == []
