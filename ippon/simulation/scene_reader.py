"""Reader of scene folders: `scene.glb` with one node per object, and `scene.json`."""

import json
import math
import struct
from pathlib import Path
from typing import Any, cast

import numpy as np
import trimesh
from numpy.typing import NDArray

from ippon.errors import SceneError
from ippon.simulation.scene import Instance, Room, Scene, StartPose
from ippon.vocabulary import MATTERPORT_40

_CATEGORY_ALIASES = {"tv_monitor": "tv"}
"""Names in scene folders of categories that `MATTERPORT_40` calls differently."""

_trimesh: Any = trimesh
"""Untyped, because most return types of trimesh are unusable."""

LICENCE_MARK = "; licence: "
"""Separator of source and licence in `Scene.source` of a loaded folder."""
_BOX_TOLERANCE_M = 0.05

# Exceptions of trimesh and its readers for damaged files.
_BAD_GLB = (
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    AttributeError,
    AssertionError,
    struct.error,
    OSError,
)


def load_scene(folder: Path) -> Scene:
    """Load a home from a folder with `scene.glb` and `scene.json`.

    The glb is z-up in metres; no glTF y-up rotation is applied.

    Args:
        folder: The scene folder.

    Raises:
        SceneError: A file is missing or damaged, or the two files contradict each other.
    """
    description = _read_description(folder)
    instances = _instances(description, folder)
    triangles = _read_triangles(folder / "scene.glb", [i["node"] for i in instances])
    return Scene(
        name=str(description.get("name", folder.name)),
        source=str(description.get("source", "unknown"))
        + (f"{LICENCE_MARK}{description['licence']}" if description.get("licence") else ""),
        instances=tuple(_checked_instance(i, triangles, k) for k, i in enumerate(instances)),
        start_poses=_start_poses(description, folder),
        rooms=_rooms(description, folder),
        vertices=triangles.vertices,
        faces=triangles.faces,
        face_instance=triangles.face_instance,
        face_colors=triangles.face_colors,
        textures=tuple(triangles.textures),
        face_texture=triangles.face_texture if triangles.textures else None,
        face_uvs=triangles.face_uvs if triangles.textures else None,
    )


class _Triangles:
    """Content of the glb, concatenated over its nodes."""

    def __init__(self) -> None:
        self.vertices: NDArray[np.float32] = np.empty((0, 3), np.float32)
        self.faces: NDArray[np.int32] = np.empty((0, 3), np.int32)
        self.face_instance: NDArray[np.int32] = np.empty(0, np.int32)
        self.face_colors: NDArray[np.uint8] = np.empty((0, 3), np.uint8)
        self.face_texture: NDArray[np.int32] = np.empty(0, np.int32)
        self.face_uvs: NDArray[np.float32] = np.empty((0, 3, 2), np.float32)
        self.textures: list[NDArray[np.uint8]] = []
        self.boxes: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []


def _read_description(folder: Path) -> dict[str, Any]:
    if not folder.is_dir():
        raise SceneError(f"there is no scene folder {folder}")
    for name in ("scene.glb", "scene.json"):
        if not (folder / name).is_file():
            raise SceneError(f"{folder} is not a scene folder: {name} is missing")
    path = folder / "scene.json"
    try:
        parsed: Any = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise SceneError(f"{path} is not JSON: {error}") from error
    except OSError as error:
        raise SceneError(f"{path} cannot be read: {error.strerror}") from error
    if not isinstance(parsed, dict):
        raise SceneError(f"{path} must hold an object with `instances` and `start_poses`")
    description = cast("dict[str, Any]", parsed)
    for key, only in (("up", "z"), ("units", "m")):
        if description.get(key, only) != only:
            raise SceneError(f"{path} says {key} is {description[key]!r}; only {only!r} is read")
    return description


def _entries(description: dict[str, Any], key: str, folder: Path) -> list[dict[str, Any]]:
    given: Any = description.get(key, [])
    entries: list[Any] = cast("list[Any]", given) if isinstance(given, list) else [None]
    if not all(isinstance(e, dict) for e in entries):
        raise SceneError(f"{folder / 'scene.json'}: `{key}` must be a list of objects")
    return entries


def _numbers(value: Any, count: int, what: str) -> tuple[float, ...]:
    values = cast("list[Any]", value) if isinstance(value, list) else []
    if len(values) == count:
        numbers = tuple(_number(v) for v in values)
        if all(math.isfinite(v) for v in numbers):
            return numbers
    raise SceneError(f"{what} must be {count} finite numbers; got {value!r}")


def _number(value: Any) -> float:
    """Return a number, NaN for anything else."""
    try:
        return float(value) if isinstance(value, int | float) else math.nan
    except OverflowError:
        return math.nan


def _instances(description: dict[str, Any], folder: Path) -> list[dict[str, Any]]:
    entries = _entries(description, "instances", folder)
    if not entries:
        raise SceneError(f"{folder / 'scene.json'} lists no instances")
    seen: set[str] = set()
    for entry in entries:
        node = entry.get("node")
        if not isinstance(node, str) or not node:
            raise SceneError(f"{folder / 'scene.json'}: an instance has no `node` name: {entry!r}")
        if node in seen:
            raise SceneError(f"{folder / 'scene.json'} lists node {node!r} twice")
        seen.add(node)
        category = entry.get("category")
        entry["category"] = _CATEGORY_ALIASES.get(str(category), str(category))
        if entry["category"] not in MATTERPORT_40:
            raise SceneError(
                f"node {node!r} has category {category!r}, which is not one of the 40 Matterport "
                f"categories: {', '.join(MATTERPORT_40)}"
            )
    return entries


def _checked_instance(entry: dict[str, Any], triangles: _Triangles, row: int) -> Instance:
    """Return an instance, after comparing the stated box with that of its triangles."""
    low, high = triangles.boxes[row]
    for key, measured in (("aabb_min", low), ("aabb_max", high)):
        stated = _numbers(entry.get(key), 3, f"{key} of node {entry['node']!r}")
        if np.abs(measured - stated).max() > _BOX_TOLERANCE_M:
            raise SceneError(
                f"node {entry['node']!r} has {key} {stated} in scene.json but "
                f"{tuple(measured.round(3).tolist())} in scene.glb; the glb must be z up in metres"
            )
    room = entry.get("room")
    return Instance(
        node=entry["node"],
        category=entry["category"],
        label=str(entry.get("label") or entry["category"].replace("_", " ")),
        aabb_min=cast("tuple[float, float, float]", tuple(low.tolist())),
        aabb_max=cast("tuple[float, float, float]", tuple(high.tolist())),
        room=room if isinstance(room, str) else None,
    )


def _start_poses(description: dict[str, Any], folder: Path) -> tuple[StartPose, ...]:
    entries = _entries(description, "start_poses", folder)
    if not entries:
        raise SceneError(f"{folder / 'scene.json'} lists no start poses")
    poses: list[StartPose] = []
    for entry in entries:
        values = [entry.get(key) for key in ("x", "y", "z", "yaw")]
        x, y, z, yaw = _numbers(values, 4, "x, y, z and yaw of a start pose")
        poses.append(StartPose(x=x, y=y, z=z, yaw=yaw))
    return tuple(poses)


def _rooms(description: dict[str, Any], folder: Path) -> tuple[Room, ...]:
    rooms: list[Room] = []
    for entry in _entries(description, "rooms", folder):
        name, given = entry.get("name"), entry.get("polygon")
        corners = cast("list[Any]", given) if isinstance(given, list) else []
        if not isinstance(name, str) or len(corners) < 3:
            raise SceneError(f"a room needs a `name` and a `polygon` of 3 corners; got {entry!r}")
        points = [_numbers(c, 2, f"a corner of room {name!r}") for c in corners]
        polygon = np.array(points, dtype=np.float64)
        rooms.append(Room(name=name, polygon=polygon if _area(polygon) > 0 else polygon[::-1]))
    return tuple(rooms)


def _area(polygon: NDArray[np.float64]) -> float:
    x, y = polygon[:, 0], polygon[:, 1]
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _read_triangles(path: Path, nodes: list[str]) -> _Triangles:
    try:
        graph = _trimesh.load_scene(path, process=False)
        present = list(graph.graph.nodes_geometry)
    except _BAD_GLB as error:
        raise SceneError(f"{path} is damaged or not a binary glTF file: {error}") from error
    missing = sorted(set(nodes) - set(present))
    unknown = sorted(set(present) - set(nodes))
    if missing:
        raise SceneError(f"scene.json lists nodes that {path} lacks: {', '.join(missing[:5])}")
    if unknown:
        raise SceneError(f"{path} has nodes that scene.json lacks: {', '.join(unknown[:5])}")
    parts = [_node_part(graph, node) for node in nodes]
    return _join(parts)


def _node_part(graph: Any, node: str) -> tuple[Any, ...]:
    """Return vertices, faces, colour, texture image and UVs of one node, in world coordinates."""
    transform, geometry = graph.graph[node]
    mesh: Any = graph.geometry[geometry]
    if not isinstance(mesh, _trimesh.Trimesh) or len(mesh.faces) == 0:
        raise SceneError(f"node {node!r} has no triangles")
    vertices = np.asarray(mesh.vertices, np.float64) @ transform[:3, :3].T + transform[:3, 3]
    if not np.isfinite(vertices).all():
        raise SceneError(f"node {node!r} has vertices that are not finite numbers")
    faces = np.asarray(mesh.faces, np.int64)
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise SceneError(f"node {node!r} has faces whose vertex indices are out of range")
    color = np.array([255, 255, 255], np.uint8)  # the default factor of glTF
    image: Any = None
    uv: Any = getattr(mesh.visual, "uv", None)
    material: Any = getattr(mesh.visual, "material", None)
    if material is not None:
        if getattr(material, "baseColorFactor", None) is not None:
            color = np.asarray(material.baseColorFactor, np.uint8)[:3]
        image = getattr(material, "baseColorTexture", None) if uv is not None else None
    return vertices, faces, color, image, uv


def _join(parts: list[tuple[Any, ...]]) -> _Triangles:
    out = _Triangles()
    rows: dict[bytes, int] = {}
    columns: list[list[Any]] = [[] for _ in range(6)]
    offset = 0
    for k, (vertices, faces, color, image, uv) in enumerate(parts):
        n = len(faces)
        texture = -1 if image is None else _texture_row(image, color, rows, out.textures)
        corners = np.zeros((n, 3, 2)) if image is None else np.asarray(uv)[faces]
        if not np.isfinite(corners).all():
            raise SceneError("a texture coordinate is not a finite number")
        for column, values in zip(
            columns,
            (
                vertices,
                faces + offset,
                np.full(n, k),
                np.broadcast_to(color, (n, 3)),
                np.full(n, texture),
                corners,
            ),
            strict=True,
        ):
            column.append(values)
        out.boxes.append((vertices.min(axis=0), vertices.max(axis=0)))
        offset += len(vertices)
    out.vertices = np.concatenate(columns[0]).astype(np.float32)
    out.faces = np.concatenate(columns[1]).astype(np.int32)
    out.face_instance = np.concatenate(columns[2]).astype(np.int32)
    out.face_colors = np.concatenate(columns[3]).astype(np.uint8)
    out.face_texture = np.concatenate(columns[4]).astype(np.int32)
    out.face_uvs = np.concatenate(columns[5]).astype(np.float32)
    return out


def _texture_row(
    image: Any, factor: NDArray[np.uint8], rows: dict[bytes, int], textures: list[NDArray[np.uint8]]
) -> int:
    """Return the row of an image among `textures`, adding it when it is new."""
    try:
        pixels = np.asarray(image.convert("RGB"), np.uint8)
    except (OSError, ValueError) as error:
        raise SceneError(f"a texture cannot be read: {error}") from error
    if (factor != 255).any():
        pixels = (pixels.astype(np.uint16) * factor // 255).astype(np.uint8)
    key = repr(pixels.shape).encode() + pixels.tobytes()
    if key not in rows:
        rows[key] = len(textures)
        textures.append(pixels)
    return rows[key]
