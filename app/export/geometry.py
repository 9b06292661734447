"""The map as a point cloud or as voxel faces, with the colours of the page."""

from pathlib import Path
from typing import Any, Final

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.export.session_data import SessionData, need_map
from app.view.colors import linear
from app.view.model.attribute_colors import AttributeColor, attribute_colors

_Y_UP: Final = trimesh.transformations.rotation_matrix(-0.5 * np.pi, (1.0, 0.0, 0.0))
# For each of the six sides: outward direction, and corners counter-clockwise from outside.
_SIDES: Final = (
    ((1, 0, 0), ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1))),
    ((-1, 0, 0), ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0))),
    ((0, 1, 0), ((0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0))),
    ((0, -1, 0), ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1))),
    ((0, 0, 1), ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))),
    ((0, 0, -1), ((0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0))),
)


def write_points(session: SessionData, path: Path, mode: AttributeColor) -> None:
    """Write the centres of the surface voxels as a PLY.

    Raises:
        RecordingError: There is no map.
    """
    indices, attributes, voxel_m = need_map(session)
    colors = attribute_colors(indices, attributes, voxel_m, mode, session.scene.floor_z_m)
    cloud: Any = trimesh.PointCloud((indices + 0.5) * voxel_m, colors=colors)
    path.write_bytes(cloud.export(file_type="ply"))


def write_faces(session: SessionData, path: Path, mode: AttributeColor) -> None:
    """Write the outer faces of the surface voxels as a GLB: y up, colours linear, as glTF demands.

    Raises:
        RecordingError: There is no map.
    """
    faces = voxel_faces(session, mode)
    colors = faces.visual.vertex_colors
    colors[:, :3] = linear(colors[:, :3])
    faces.visual.vertex_colors = colors
    scene: Any = trimesh.Scene()
    scene.add_geometry(faces, node_name="map", transform=_Y_UP)
    path.write_bytes(scene.export(file_type="glb"))


def voxel_faces(session: SessionData, mode: AttributeColor) -> Any:
    """Return the outer faces of surface voxels, with the colours of the voxels.

    Raises:
        RecordingError: There is no map.
    """
    indices, attributes, voxel_m = need_map(session)
    colors = attribute_colors(indices, attributes, voxel_m, mode, session.scene.floor_z_m)
    low = indices.min(axis=0) - 1
    solid = np.zeros(indices.max(axis=0) - low + 2, np.bool_)
    cells = indices - low
    solid[tuple(cells.T)] = True
    vertices: list[NDArray[np.float64]] = []
    shades: list[NDArray[np.uint8]] = []
    for out, corners in _SIDES:
        bare = ~solid[tuple((cells + out).T)]
        base = indices[bare][:, None, :] + np.array(corners)[None]
        vertices.append(base.reshape(-1, 3).astype(np.float64) * voxel_m)
        shades.append(np.repeat(colors[bare], 4, axis=0))
    points = np.concatenate(vertices)
    quads = np.arange(len(points)).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return trimesh.Trimesh(
        points, faces, vertex_colors=np.concatenate(shades), process=False, validate=False
    )
