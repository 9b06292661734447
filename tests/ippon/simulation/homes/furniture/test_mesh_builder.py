import math

import numpy as np
import pytest
import trimesh

from ippon.simulation.homes.furniture.mesh_builder import MeshBuilder

GREY = (120, 120, 120)


def _volume(mesh):
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    assert solid.is_watertight
    solid.fix_normals()
    return abs(solid.volume)


def test_solids_are_closed_and_have_their_volume():
    box = MeshBuilder().box((0, 0, 0), (1, 2, 3), GREY).build()
    assert _volume(box) == pytest.approx(6.0)
    frustum = MeshBuilder().frustum((1, 1), (0, 2), (0.5, 0.5), GREY, sides=64).build()
    assert _volume(frustum) == pytest.approx(math.pi * 0.25 * 2.0, rel=0.01)
    ball = MeshBuilder().ball((0, 0, 0), (1, 2, 3), GREY, sides=48, rings=32).build()
    assert _volume(ball) == pytest.approx(4.0 / 3.0 * math.pi * 6.0, rel=0.02)
    rod = MeshBuilder().rod((0, 0, 0), (1, 1, 1), 0.1, GREY).build()
    assert _volume(rod) == pytest.approx(0.01 * math.sqrt(3.0))
    upright = MeshBuilder().rod((0, 0, 0), (0, 0, 2), 0.1, GREY).build()
    assert _volume(upright) == pytest.approx(0.02)


def test_sides_take_their_own_colours():
    red = (255, 0, 0)
    mesh = MeshBuilder().box((0, 0, 0), (1, 1, 1), GREY, faces={"top": red, "low_x": red}).build()
    for face, color in zip(mesh.vertices[mesh.faces], mesh.colors, strict=True):
        top = (face[:, 2] == 1.0).all()
        low_x = (face[:, 0] == 0.0).all()
        assert (tuple(color) == red) == bool(top or low_x)


def test_turning_and_shifting_moves_every_corner():
    mesh = MeshBuilder().box((0, 0, 0), (1, 2, 3), GREY).build().moved(5.0, 6.0, 7.0, math.pi / 2)
    np.testing.assert_allclose(mesh.vertices.min(axis=0), (3.0, 6.0, 7.0), atol=1e-12)
    np.testing.assert_allclose(mesh.vertices.max(axis=0), (5.0, 7.0, 10.0), atol=1e-12)


def test_meshes_join_with_their_colours():
    part = MeshBuilder().box((0, 0, 0), (1, 1, 1), (1, 2, 3)).build()
    both = MeshBuilder().box((2, 0, 0), (3, 1, 1), GREY).add_mesh(part).build()
    assert len(both.faces) == 24
    assert both.faces.max() == 15
    assert both.colors[-1].tolist() == [1, 2, 3]


def test_a_leaf_shows_from_above():
    leaf = MeshBuilder().leaf((0, 0, 0), (0.3, 0.1, 0.4), 0.1, GREY).build()
    flat = trimesh.Trimesh(leaf.vertices * (1, 1, 0), leaf.faces, process=False)
    assert flat.area > 0.005
    upright = MeshBuilder().leaf((0, 0, 0), (0, 0, 0.4), 0.1, GREY).build()
    assert np.isfinite(upright.vertices).all()
