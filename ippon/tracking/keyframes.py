"""Small pictures of where the camera has been, to find its place again."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array

SIZE: Final = (24, 32)
"""(H, W) of a small picture."""
APART_M: Final = 0.25
APART_RAD: Final = 0.26
"""A frame that differs from all keyframes by more, in place or direction, becomes one."""
MOST: Final = 2000
"""Keyframes that are kept; no further ones are taken, so that the first places stay known."""


class Keyframes:
    """Pictures and poses; the most similar are candidates of a lost camera's pose."""

    def __init__(self) -> None:
        self._pictures: list[NDArray[np.float32]] = []
        self._poses: list[Float64Array] = []

    def __len__(self) -> int:
        return len(self._poses)

    def offer(self, color: NDArray[np.uint8], T_world_camera: Float64Array) -> None:
        """Keep a frame that differs from those that are known."""
        if len(self._poses) >= MOST:
            return
        if self._poses:
            known = np.stack(self._poses)
            near = np.linalg.norm(known[:, :3, 3] - T_world_camera[:3, 3], axis=1) < APART_M
            # The trace of the relative rotation gives its angle.
            trace = np.einsum("nij,ij->n", known[:, :3, :3], T_world_camera[:3, :3])
            angle = np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0))
            if np.any(near & (angle < APART_RAD)):
                return
        self._pictures.append(small_picture(color))
        self._poses.append(T_world_camera.copy())

    def similar(self, color: NDArray[np.uint8], most: int) -> list[Float64Array]:
        """Return the poses of the most similar keyframes, the most similar first."""
        if not self._poses:
            return []
        picture = small_picture(color)
        alike = np.stack(self._pictures).reshape(len(self._pictures), -1) @ picture.ravel()
        return [self._poses[k] for k in np.argsort(-alike)[:most].tolist()]


def small_picture(color: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return an image reduced to `SIZE`, grey, with mean 0 and norm 1; 0 for an even image."""
    height, width = SIZE
    rows = np.linspace(0, color.shape[0], height + 1).astype(np.int64)[:-1]
    columns = np.linspace(0, color.shape[1], width + 1).astype(np.int64)[:-1]
    grey = color.mean(axis=2, dtype=np.float32)
    sums = np.add.reduceat(np.add.reduceat(grey, rows, axis=0), columns, axis=1)
    sums -= sums.mean()
    norm = float(np.linalg.norm(sums))
    return (sums / norm if norm > 0.0 else sums).astype(np.float32)
