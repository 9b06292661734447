"""The surface as triangles, computed from the recorded depth images."""

from pathlib import Path
from typing import Any

import trimesh

from app.export.session_data import OnProgress, SessionData, no_progress
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.review.frames import geometry_frames
from app.nodes.review.settings import read_settings
from app.recording.errors import RecordingError
from app.recording.reading.recording import Recording
from app.recording.writing.session import CONFIGURATION
from ippon.errors import FrameRejectedError
from ippon.mapping.mesh import copy_signed_distances, extract_mesh
from ippon.mapping.voxel_map import VoxelMap


def write_mesh(session: SessionData, path: Path, on_progress: OnProgress = no_progress) -> None:
    """Write the zero crossing of the signed distance as a PLY, coloured by the camera.

    The recorded map has voxels without distances; these are computed from the depth images, with
    the settings of the session.

    Raises:
        RecordingError: There are no depth images with poses, or they show no surface.
    """
    mesh = extract_mesh(copy_signed_distances(_map_of(session.recording, on_progress)))
    if not len(mesh.faces):
        raise RecordingError(f"{session.recording.path} shows no surface to make a mesh of")
    triangles: Any = trimesh.Trimesh(
        mesh.vertices, mesh.faces, vertex_colors=mesh.colors, process=False, validate=False
    )
    path.write_bytes(triangles.export(file_type="ply"))


def _map_of(recording: Recording, on_progress: OnProgress) -> VoxelMap:
    config = _config_of(recording)
    voxel_map = VoxelMap(config.mission.map, config.labels)
    frames = refused = 0
    for time_ns, frame in geometry_frames(recording):
        try:
            voxel_map.integrate(frame)
            frames += 1
        except FrameRejectedError:
            refused += 1
        on_progress((time_ns - recording.start_ns) * 1e-9 / max(recording.duration_s, 1e-9))
    if not frames:
        raise RecordingError(
            f"{recording.path} has no depth image with colour and pose to make a mesh of"
            + (f" ({refused} are inconsistent)" if refused else "; `ippon doctor FILE` says why")
        )
    return voxel_map


def _config_of(recording: Recording) -> NavigatorConfig:
    """Return the session's configuration; the default for bags of other programs."""
    if recording.attachment(CONFIGURATION) is None:
        return NavigatorConfig()
    return read_settings(recording, ()).navigator
