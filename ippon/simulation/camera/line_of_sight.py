"""Line of sight between points of a home, by rays through its triangles."""

import numpy as np
from numpy.typing import NDArray

from ippon.simulation.camera.ray_tree import RayTree
from ippon.simulation.scene import Scene


class LineOfSight:
    """Tests whether points of a home are visible from other points."""

    def __init__(self, scene: Scene) -> None:
        """Index the triangles of a home.

        Args:
            scene: The home; later changes to it are ignored.
        """
        self._rays = RayTree(scene.vertices[scene.faces])

    def is_clear(
        self, eyes: NDArray[np.float64], points: NDArray[np.float64], slack_m: float = 0.01
    ) -> NDArray[np.bool_]:
        """Tell for each pair whether the segment from eye to point is free.

        Args:
            eyes: (N, 3) or (3,) metres.
            points: (N, 3) metres.
            slack_m: Length before the point that is not tested, because its own surface is there.

        Returns:
            (N,) bool, whether the point is visible.
        """
        origins = np.broadcast_to(eyes, points.shape)
        segment = points - origins
        length = np.linalg.norm(segment, axis=1)
        scale = np.maximum(length - slack_m, 0.0) / np.maximum(length, 1e-9)
        segment = segment * scale[:, None]
        return np.logical_not(self._rays.is_hit(origins, segment))
