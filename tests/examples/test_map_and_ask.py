"""The examples run, and their answers are true."""

import runpy

import numpy as np

from tests.locations import ROOT


def test_the_most_probable_voxel_lies_at_a_plant(capsys):
    variables = runpy.run_path(str(ROOT / "examples" / "map_and_ask.py"))
    assert capsys.readouterr().out.startswith("p = ")
    best = variables["points"][variables["best"]]
    boxes = [i for i in variables["home"].instances if i.category == "plant"]
    reach = 2 * variables["voxel_map"].config.voxel_size_m
    assert any(
        np.all(best > np.array(box.aabb_min) - reach)
        and np.all(best < np.array(box.aabb_max) + reach)
        for box in boxes
    )
