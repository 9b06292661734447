"""What can be seen from where: rays through the triangles of a home."""

from typing import Any

import numpy as np
import open3d
from numpy.typing import NDArray

from ippon.simulation.scene import Scene

_o3d: Any = open3d
"""Untyped on purpose: open3d's stubs refuse the arrays that it takes."""


class LineOfSight:
    """Answers whether points of a home are seen from other points."""

    def __init__(self, scene: Scene) -> None:
        """Index the triangles of a home.

        Args:
            scene: The home; later changes to it are not noticed.
        """
        self._rays = _o3d.t.geometry.RaycastingScene(nthreads=1)
        vertices = np.ascontiguousarray(scene.vertices, np.float32)
        faces = np.ascontiguousarray(scene.faces, np.uint32)
        self._rays.add_triangles(_o3d.core.Tensor(vertices), _o3d.core.Tensor(faces))

    def is_clear(
        self, eyes: NDArray[np.float64], points: NDArray[np.float64], slack_m: float = 0.01
    ) -> NDArray[np.bool_]:
        """Tell for each pair whether nothing stands between eye and point.

        Args:
            eyes: (N, 3) or (3,) metres.
            points: (N, 3) metres.
            slack_m: The last stretch before the point, which its own surface may fill.

        Returns:
            (N,) whether the point is seen.
        """
        origins = np.broadcast_to(eyes, points.shape)
        way = points - origins
        length = np.linalg.norm(way, axis=1)
        way = way * (np.maximum(length - slack_m, 0.0) / np.maximum(length, 1e-9))[:, None]
        rays = np.concatenate([origins, way], axis=1).astype(np.float32)
        hit = self._rays.test_occlusions(_o3d.core.Tensor(rays), tnear=0.0, tfar=1.0, nthreads=1)
        return np.logical_not(hit.numpy())
