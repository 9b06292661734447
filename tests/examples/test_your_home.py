"""A mesh of one's own gets the description that a search needs."""

import runpy
import sys

import numpy as np
import trimesh

from app.homes import load_home
from tests.locations import ROOT


def test_a_mesh_becomes_a_home(tmp_path, monkeypatch, capsys):
    scene = trimesh.Scene()
    for node, size, centre in (
        ("floor.0", (6.0, 5.0, 0.1), (3.0, 2.5, -0.05)),
        ("bed.0", (2.0, 1.0, 0.5), (4.0, 3.0, 0.25)),
        ("hat.0", (0.3, 0.3, 0.2), (4.0, 3.0, 0.6)),
    ):
        pose = trimesh.transformations.translation_matrix(centre)
        scene.add_geometry(trimesh.creation.box(size), node_name=node, transform=pose)
    turned = trimesh.transformations.rotation_matrix(np.pi / 4, (0.0, 0.0, 1.0))
    turned[:3, 3] = (1.5, 4.0, 0.3)
    vase = trimesh.creation.cylinder(0.4, 0.6)
    scene.add_geometry(vase, node_name="vase.0", transform=turned)
    folder = tmp_path / "mine"
    folder.mkdir()
    scene.export(folder / "scene.glb")
    monkeypatch.setattr(sys, "argv", ["your_home.py", str(folder), "1", "1.5"])
    runpy.run_path(str(ROOT / "examples" / "your_home.py"))
    assert capsys.readouterr().out.endswith("scene.json: 4 things\n")
    home = load_home(str(folder))
    things = {one.node: one for one in home.instances}
    assert things["hat.0"].category == "others"
    assert things["hat.0"].label == "hat"
    np.testing.assert_allclose(things["bed.0"].aabb_min, (3.0, 2.5, 0.0), atol=1e-5)
    np.testing.assert_allclose(things["bed.0"].aabb_max, (5.0, 3.5, 0.5), atol=1e-5)
