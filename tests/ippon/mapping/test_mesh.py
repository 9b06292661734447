"""The mesh lies on the surface."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from ippon.mapping import mesh as mesh_module
from ippon.mapping.config import MapConfig
from ippon.mapping.mesh import copy_signed_distances, extract_mesh
from ippon.mapping.voxel_map import VoxelMap


@pytest.fixture(scope="module")
def voxel_map(tools):
    world = tools.World.room()
    voxel_map = VoxelMap(MapConfig(voxel_size_m=0.05), ("thing",))
    for n, pose in enumerate(tools.tour([(1.0, 1.0), (3.0, 3.0)])):
        voxel_map.integrate(world.frame(pose, stamp_ns=n * 10**9))
    return voxel_map


@pytest.mark.slow
def test_vertices_lie_on_the_walls(voxel_map):
    mesh = extract_mesh(copy_signed_distances(voxel_map))
    assert len(mesh.faces) > 10000
    assert mesh.faces.max() < len(mesh.vertices) == len(mesh.colors)
    to_walls = np.minimum(np.abs(mesh.vertices), np.abs(mesh.vertices - (4.0, 4.0, 2.5)))
    error = to_walls.min(axis=1)
    assert np.median(error) < 0.004
    assert np.quantile(error, 0.98) < 0.025
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    floor = (
        (np.abs(middle[:, 2]) < 0.02) & (middle[:, :2] > 0.3).all(1) & (middle[:, :2] < 3.7).all(1)
    )
    a, b, c = (mesh.vertices[mesh.faces[floor, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert area == pytest.approx(3.4**2, rel=0.03)


def test_chunks_leave_no_seams(voxel_map, monkeypatch):
    whole = extract_mesh(copy_signed_distances(voxel_map))
    monkeypatch.setattr(mesh_module, "CHUNK_BLOCKS", 3)
    chunked = extract_mesh(copy_signed_distances(voxel_map))
    assert len(chunked.faces) == len(whole.faces)
    for some, others in ((whole, chunked), (chunked, whole)):
        distance, _ = cKDTree(others.vertices).query(some.vertices)
        assert distance.max() < 1e-4


def test_an_empty_map_has_an_empty_mesh():
    empty = VoxelMap(MapConfig(memory_limit_mb=64.0), ("thing",))
    mesh = extract_mesh(copy_signed_distances(empty))
    assert mesh.vertices.shape == (0, 3)
    assert mesh.faces.shape == (0, 3)
