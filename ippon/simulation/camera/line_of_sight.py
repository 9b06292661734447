"""What can be seen from where: rays through the triangles of a home."""

import numpy as np
from numpy.typing import NDArray

from ippon.simulation.camera.ray_tree import RayTree
from ippon.simulation.scene import Scene


class LineOfSight:
    """Answers whether points of a home are seen from other points."""

    def __init__(self, scene: Scene) -> None:
        """Index the triangles of a home.

        Args:
            scene: The home; later changes to it are not noticed.
        """
        self._rays = RayTree(scene.vertices[scene.faces])

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
        return np.logical_not(self._rays.is_hit(origins, way))
