"""The surface as triangles."""

from dataclasses import replace

import numpy as np
import trimesh

from app.export import mesh
from app.export.mesh import write_mesh
from app.export.session_data import read_session_data
from app.recognition.frames import Tally
from ippon.errors import FrameRejectedError
from ippon.mapping.voxel_map import VoxelMap
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


def test_what_a_mesh_lacks_is_said(tmp_path, monkeypatch, caplog):
    integrate = VoxelMap.integrate
    rejected = iter([True])

    def integrate_with_less_memory(voxel_map, frame):
        if next(rejected, False):
            raise FrameRejectedError("inconsistent")
        return replace(integrate(voxel_map, frame), blocks_dropped=2)

    monkeypatch.setattr(VoxelMap, "integrate", integrate_with_less_memory)
    monkeypatch.setattr(Tally, "note", property(lambda tally: f"note of {tally.images} images"))
    session = read_session_data(write_session(tmp_path, 2.0).writer.folder)
    write_mesh(session, tmp_path / "mesh.ply")
    session.recording.close()
    lines = [record.getMessage() for record in caplog.records if record.name == mesh.__name__]
    assert [line.split(":")[0] for line in lines[:2]] == ["the mesh may have holes"] * 2
    assert lines[0].endswith(" images")
    assert lines[1].endswith(": 1 images were inconsistent")
    assert "memory limit of" in lines[2]
