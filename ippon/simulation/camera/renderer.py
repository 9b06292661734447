"""Colour, depth and instance images of a scene from any camera pose."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, invert_transform
from ippon.simulation.camera.raster import (
    Float32Array,
    Int32Array,
    image_boxes,
    rasterise,
    visible_instances,
)
from ippon.simulation.camera.shading import SurfaceColors, shade
from ippon.simulation.scene import Scene

UInt8Array = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rendering:
    """Images of a noise-free camera."""

    color: UInt8Array
    """(H, W, 3) RGB."""
    depth: Float32Array
    """(H, W) metres along the optical axis; 0 where there is no surface within range."""
    instance: Int32Array
    """(H, W) row of `Scene.instances` at any range, -1 for none."""


class SceneRenderer:
    """Renders one scene; serial, deterministic and stateless between images."""

    def __init__(self, scene: Scene) -> None:
        order = np.argsort(scene.face_instance, kind="stable")
        owner = scene.face_instance[order]
        faces = scene.faces[order]
        # Vertices are contiguous per instance, so that instances out of view are skipped at once.
        pairs = owner[:, None].astype(np.int64) * len(scene.vertices) + faces
        unique, inverse = np.unique(pairs, return_inverse=True)
        self._vertices = np.ascontiguousarray(scene.vertices[unique % len(scene.vertices)])
        self._faces = inverse.reshape(faces.shape).astype(np.int32)
        self._face_instance = owner.astype(np.int32)
        vertex_owner = unique // len(scene.vertices)
        drawn = np.unique(owner)
        ends = (
            np.searchsorted(vertex_owner, drawn, "left"),
            np.searchsorted(vertex_owner, drawn, "right"),
            np.searchsorted(owner, drawn, "left"),
            np.searchsorted(owner, drawn, "right"),
        )
        self._ranges = np.stack(ends, axis=1).astype(np.int32)
        self._aabb_min = np.array(
            [self._vertices[a:b].min(axis=0) for a, b, _, _ in self._ranges], dtype=np.float64
        ).reshape(-1, 3)
        self._aabb_max = np.array(
            [self._vertices[a:b].max(axis=0) for a, b, _, _ in self._ranges], dtype=np.float64
        ).reshape(-1, 3)
        self._colors = SurfaceColors.of(scene, order, self._vertices, self._faces)

    def render(
        self,
        camera: PinholeCamera,
        T_world_camera: Float64Array,
        max_depth_m: float = math.inf,
    ) -> Rendering:
        """Render an image.

        Args:
            camera: Intrinsics and image size.
            T_world_camera: (4, 4) pose of the camera.
            max_depth_m: Depth beyond this reads 0; colour and instances are not limited.
        """
        size = (camera.height, camera.width)
        inverse_depth = np.empty(size, dtype=np.float32)
        face_index = np.empty(size, dtype=np.int32)
        intrinsics = np.array(
            [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]]
        )
        projection = intrinsics @ invert_transform(T_world_camera)[:3]
        seen = visible_instances(
            projection, camera.width, camera.height, self._aabb_min, self._aabb_max
        )
        order = self._nearest_first(seen, T_world_camera[:3, 3])
        boxes = image_boxes(
            projection, camera.width, camera.height, self._aabb_min[order], self._aabb_max[order]
        )
        rasterise(
            projection,
            self._vertices,
            self._faces,
            self._ranges[order],
            boxes,
            inverse_depth,
            face_index,
        )
        color = np.empty((*size, 3), dtype=np.uint8)
        depth = np.empty(size, dtype=np.float32)
        instance = np.empty(size, dtype=np.int32)
        shade(
            self._colors,
            camera,
            T_world_camera,
            inverse_depth,
            face_index,
            self._face_instance,
            max_depth_m,
            color,
            depth,
            instance,
        )
        return Rendering(color=color, depth=depth, instance=instance)

    def _nearest_first(self, seen: NDArray[np.bool_], eye_world: Float64Array) -> NDArray[np.int64]:
        """Order the instances in view by the distance of their box."""
        rows = np.flatnonzero(seen)
        nearest = np.clip(eye_world, self._aabb_min[rows], self._aabb_max[rows])
        distance = ((nearest - eye_world) ** 2).sum(axis=1)
        return rows[np.argsort(distance, kind="stable")]
