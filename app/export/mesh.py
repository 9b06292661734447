"""The surface as triangles, computed from the recorded depth images."""

import logging
from pathlib import Path
from typing import Any

import trimesh

from app.datasets.dataset import DatasetError
from app.export.session_data import OnProgress, SessionData, no_progress
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.localization.alignment import in_map_frame
from app.nodes.review.settings import read_settings
from app.recognition.frames import FrameSource, open_source
from app.recording.camera_topics import COLORS
from app.recording.errors import RecordingError
from app.recording.map_alignment import MapAlignments
from app.recording.writing.session import CONFIGURATION
from ippon.errors import FrameRejectedError
from ippon.mapping.mesh import copy_signed_distances, extract_mesh
from ippon.mapping.voxel_map import VoxelMap

logger = logging.getLogger(__name__)


def write_mesh(session: SessionData, path: Path, on_progress: OnProgress = no_progress) -> None:
    """Write the zero crossing of the signed distance as a PLY, coloured by the camera.

    The recorded map has voxels without distances; these are computed from the depth images, with
    the settings of the session.

    Raises:
        RecordingError: There are no depth images with poses, or they show no surface.
    """
    mesh = extract_mesh(copy_signed_distances(_map_of(session, on_progress)))
    if not len(mesh.faces):
        raise RecordingError(f"{session.recording.path} shows no surface to make a mesh of")
    triangles: Any = trimesh.Trimesh(
        mesh.vertices, mesh.faces, vertex_colors=mesh.colors, process=False, validate=False
    )
    path.write_bytes(triangles.export(file_type="ply"))


def _map_of(session: SessionData, on_progress: OnProgress) -> VoxelMap:
    recording = session.recording
    is_ours = recording.attachment(CONFIGURATION) is not None
    config = read_settings(recording, ()).navigator if is_ours else NavigatorConfig()
    voxel_map = VoxelMap(config.mission.map, config.labels)
    # A robot that is named with the command knows better than the session.
    offset_s = session.robot.clock_offset_s or config.camera_clock_offset_s
    times_ns = max((recording.times_ns(key) for key in COLORS), key=len)
    alignments = MapAlignments(recording)
    used = refused = dropped = 0
    try:
        source = _source_of(session, offset_s)
        for frame in source.frames():
            try:
                T_map_world = alignments.at(int(times_ns[source.tally.images - 1]))
                report = voxel_map.integrate(in_map_frame(frame, T_map_world))
                dropped += report.blocks_dropped
                used += 1
            except FrameRejectedError:
                refused += 1
            on_progress(source.tally.images / len(times_ns))
    except DatasetError as error:
        raise RecordingError(
            f"no depth image with colour and pose to make a mesh of: {error}; `ippon doctor FILE` "
            "says what is missing"
        ) from error
    if not used:
        raise RecordingError(f"{recording.path}: its {refused} images are inconsistent")
    if source.tally.note:
        logger.warning("the mesh may have holes: %s", source.tally.note)
    if refused:
        logger.warning("the mesh may have holes: %d images were inconsistent", refused)
    if dropped:
        logger.warning(
            "the mesh is not whole: the map's memory limit of %g MB was reached, and %d of its "
            "oldest blocks were dropped", config.mission.map.memory_limit_mb, dropped,
        )  # fmt: skip
    return voxel_map


def _source_of(session: SessionData, clock_offset_s: float) -> FrameSource:
    robot = session.robot
    source = open_source(
        session.path,
        names=robot.names,
        mount=robot.T_base_camera,
        clock_offset_s=clock_offset_s,
        base=robot.base,
    )
    if source.note:
        logger.warning("%s", source.note)
    return source
