import io

import numpy as np
import pytest
import trimesh

from app.view.exports import FILES, figures_csv, map_ply, trail_csv
from app.view.model.scene_model import SceneModel
from app.view.words import ENGLISH
from tests.app.nodes.console.drawn_home import (
    VOXEL_M,
    cloud_of,
    home_voxels,
    proximity_of,
    status_of,
)


@pytest.fixture
def model():
    """A home with a hat on its sofa."""
    model = SceneModel()
    model.on_status(status_of())
    model.on_keyframe(cloud_of(*home_voxels(), 1, hat=True))
    model.on_proximity(proximity_of())
    model.on_status(status_of(stamp_ns=12_000_000_000, best_ooi=0.7))
    model.trail_world = [(0.0, 0.0, 0.0), (0.05, 0.0, 0.0)]
    return model


def test_another_program_reads_the_map(model):
    cloud = trimesh.load(io.BytesIO(map_ply(model)), file_type="ply")
    indices, attributes = model.voxels.all_voxels()
    np.testing.assert_allclose(cloud.vertices, (indices + 0.5) * VOXEL_M, atol=1e-6)
    np.testing.assert_array_equal(cloud.colors[:, :3], attributes[:, :3])
    content = cloud.metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_allclose(content["object_probability"], attributes[:, 3] / 254, atol=1e-6)
    np.testing.assert_array_equal(content["thing"], attributes[:, 6])


def test_the_header_names_things_and_keeps_text_from_outside_on_its_line(model):
    model.proximity.rows[0] = type(model.proximity.rows[0])(
        label="wall\nend_header\né", level="far", reason=""
    )
    head = map_ply(model).partition(b"end_header\n")[0].decode("ascii")
    assert "comment thing 0: wall?end_header??" in head
    assert "comment thing 2: sofa" in head


def test_way_and_plots_are_tables(model):
    assert trail_csv(model) == b"x_m,y_m,z_m\n0,0,0\n0.05,0,0\n"
    lines = figures_csv(model).decode().splitlines()
    assert lines[0].startswith("time_s,best_match,explored_m2")
    assert [line.split(",")[:2] for line in lines[1:]] == [["0", "0.41"], ["2", "0.7"]]


@pytest.mark.parametrize("name", FILES)
def test_of_nothing_there_is_no_file(name):
    assert FILES[name][1](SceneModel(), ENGLISH) is None
