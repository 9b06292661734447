"""A home for simulation: labelled triangles, start poses, rooms."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Instance:
    """One object of the home."""

    node: str
    """Unique name, `<category>.<index>`."""
    category: str
    """One of the 40 Matterport labels."""
    label: str
    """Specific English noun, for example "armchair" or "hat"."""
    aabb_min: tuple[float, float, float]
    aabb_max: tuple[float, float, float]
    room: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StartPose:
    """A pose on the floor from which a robot may start; metres and radians."""

    x: float
    y: float
    z: float
    yaw: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """A room with its type."""

    name: str
    """`<room type>.<index>`, for example `kitchen.0`."""
    polygon: NDArray[np.float64]
    """(K, 2) corners in metres, counter-clockwise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """Triangles of every instance; metres, z up, floor top at z = 0, surfaces double sided."""

    name: str
    source: str
    """Generator and seed, or source and licence of a scene folder."""
    instances: tuple[Instance, ...]
    start_poses: tuple[StartPose, ...]
    rooms: tuple[Room, ...]
    vertices: NDArray[np.float32]
    """(V, 3)."""
    faces: NDArray[np.int32]
    """(F, 3) rows of `vertices`."""
    face_instance: NDArray[np.int32]
    """(F,) row of `instances`."""
    face_colors: NDArray[np.uint8]
    """(F, 3) RGB, used where `face_texture` is -1."""
    textures: tuple[NDArray[np.uint8], ...] = ()
    """(h, w, 3) RGB images, wrap mode repeat, row 0 at the top."""
    face_texture: NDArray[np.int32] | None = None
    """(F,) index of `textures`, -1 for none; None when nothing is textured."""
    face_uvs: NDArray[np.float32] | None = None
    """(F, 3, 2) texture coordinates of the corners, v up; None when nothing is textured."""
