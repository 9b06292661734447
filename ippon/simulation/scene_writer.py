"""Writer of scene folders in the format that `ippon.simulation.scene_reader` reads."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from ippon.errors import SceneError
from ippon.simulation.scene import Scene
from ippon.simulation.scene_reader import LICENCE_MARK

_PALETTE_CELL = 8
"""Side in pixels of one colour in a palette texture; wide enough for any texture filter."""


def save_scene(scene: Scene, folder: Path) -> None:
    """Write a home as `scene.glb` and `scene.json`.

    An object of several plain colours gets one material with a palette texture, because the format
    has one material per node.

    Args:
        scene: The home.
        folder: Created if missing; files of these two names are overwritten.

    Raises:
        SceneError: An object has several textures, which the format does not support.
    """
    folder.mkdir(parents=True, exist_ok=True)
    images = [Image.fromarray(t) for t in scene.textures]
    graph: Any = trimesh.Scene()
    for k, instance in enumerate(scene.instances):
        rows = np.flatnonzero(scene.face_instance == k)
        mesh = _mesh_of(scene, rows, images, instance.node)
        graph.add_geometry(mesh, node_name=instance.node, geom_name=instance.node)
    (folder / "scene.glb").write_bytes(graph.export(file_type="glb"))
    text = json.dumps(_description_of(scene), indent=1)
    (folder / "scene.json").write_text(text + "\n", encoding="utf-8")


def _mesh_of(
    scene: Scene, rows: NDArray[np.intp], images: list[Image.Image], node: str
) -> trimesh.Trimesh:
    """Return the mesh of one instance with separate corners per face, so that UVs can differ."""
    corners = scene.vertices[scene.faces[rows]].reshape(-1, 3).astype(np.float64)
    faces = np.arange(len(corners)).reshape(-1, 3)
    texture = np.full(len(rows), -1) if scene.face_texture is None else scene.face_texture[rows]
    kinds = np.unique(texture)
    if len(kinds) > 1:
        raise SceneError(
            f"node {node!r} has several textures or textured and plain faces; a scene folder "
            "has one material per node"
        )
    if kinds[0] >= 0 and scene.face_uvs is not None:
        uv = scene.face_uvs[rows].reshape(-1, 2)
        material = PBRMaterial(baseColorTexture=images[int(kinds[0])])
        visual: Any = TextureVisuals(uv=uv, material=material)
    else:
        visual = _plain_visual(scene.face_colors[rows])
    return trimesh.Trimesh(corners, faces, visual=visual, process=False)


def _plain_visual(colors: NDArray[np.uint8]) -> TextureVisuals:
    palette, which = np.unique(colors, axis=0, return_inverse=True)
    if len(palette) == 1:
        factor = [*palette[0].tolist(), 255]
        return TextureVisuals(material=PBRMaterial(baseColorFactor=factor, doubleSided=True))
    cell = _PALETTE_CELL
    pixels = np.repeat(np.repeat(palette[None], cell, axis=0), cell, axis=1)
    u = (which.reshape(-1) + 0.5) / len(palette)
    uv = np.stack([np.repeat(u, 3), np.full(3 * len(u), 0.5)], axis=1)
    image = Image.fromarray(pixels)
    return TextureVisuals(uv=uv, material=PBRMaterial(baseColorTexture=image, doubleSided=True))


def _description_of(scene: Scene) -> dict[str, Any]:
    source, _, licence = scene.source.partition(LICENCE_MARK)
    return {
        "name": scene.name,
        "source": source,
        "licence": licence,
        "up": "z",
        "units": "m",
        "instances": [
            {
                "node": i.node,
                "category": i.category,
                "label": i.label,
                "aabb_min": list(i.aabb_min),
                "aabb_max": list(i.aabb_max),
                "room": i.room,
            }
            for i in scene.instances
        ],
        "start_poses": [{"x": p.x, "y": p.y, "z": p.z, "yaw": p.yaw} for p in scene.start_poses],
        "rooms": [{"name": r.name, "polygon": r.polygon.tolist()} for r in scene.rooms],
    }
