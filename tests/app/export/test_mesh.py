"""The surface as triangles."""

import numpy as np
import trimesh

from app.export.mesh import write_mesh
from app.export.session_data import read_session_data
from tests.app.recording.conftest import alignment_at, write_session


def test_the_mesh_of_an_aligned_session_lies_in_its_map(tmp_path):
    bounds = []
    for name, more in {"plain": [], "aligned": [alignment_at(1, (10.0, -3.0, 0.0))]}.items():
        folder = write_session(tmp_path / name, 2.0, more=more).writer.folder
        session = read_session_data(folder)
        write_mesh(session, tmp_path / f"{name}.ply")
        session.recording.close()
        bounds.append(trimesh.load(tmp_path / f"{name}.ply", process=False).bounds)
    np.testing.assert_allclose(bounds[1] - bounds[0], [[10.0, -3.0, 0.0]] * 2, atol=0.05)
