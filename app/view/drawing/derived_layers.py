"""Layers computed from the voxels: their surface as a mesh, and the distance to obstacles."""

import time
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from app.view.colormaps import CIVIDIS
from app.view.model.voxel_store import VoxelStore
from ippon.frame import UNDERFOOT_M

EVERY_S: Final = 2.0
"""Minimum interval between two drawings, because each processes the whole map."""
BODY_LOW_M: Final = 0.1
BODY_HIGH_M: Final = 1.2
"""Heights of the obstacles in the clearance, above the floor."""
CLEAR_M: Final = 1.5
"""Upper end of the clearance ramp."""
_SKIN: Final = (0xC6, 0xCC, 0xD4)
_GRID_MAX: Final = 2048
_LIFT_M: Final = 0.03
_QUADS: Final = np.array(
    [
        [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]], [[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 0]],
        [[0, 1, 0], [0, 1, 1], [1, 1, 1], [1, 1, 0]], [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]],
        [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]],
    ],
    dtype=np.float32,
)  # fmt: skip
_SIDES: Final = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))


class DerivedLayers:
    """Draws the layers under fixed node names, at most every `EVERY_S`."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._skin: Any = None
        self._clearance: Any = None
        self._drawn_at = -EVERY_S

    def draw(
        self,
        store: VoxelStore,
        voxel_size_m: float,
        ceiling_m: float | None,
        shown: frozenset[str],
        floor_z_m: float,
    ) -> None:
        """Draw the selected layers of "mesh" and "clearance", and hide the others."""
        self._hide(shown)
        now = time.monotonic()
        if not shown & {"mesh", "clearance"} or now - self._drawn_at < EVERY_S:
            return
        self._drawn_at = now
        voxels, _ = store.all_voxels()
        if "mesh" in shown:
            below = np.inf if ceiling_m is None else (floor_z_m + ceiling_m) / voxel_size_m
            self._draw_skin(voxels[voxels[:, 2] < below], voxel_size_m)
        if "clearance" in shown:
            self._draw_clearance(voxels, voxel_size_m, floor_z_m)

    def restart(self) -> None:
        """Draw at the next call, regardless of the interval."""
        self._drawn_at = -EVERY_S

    def _hide(self, shown: frozenset[str]) -> None:
        for name, handle in (("mesh", self._skin), ("clearance", self._clearance)):
            if handle is not None and name not in shown:
                handle.visible = False

    def _draw_skin(self, voxels: NDArray[np.int64], voxel_size_m: float) -> None:
        if self._skin is not None:
            self._skin.remove()
            self._skin = None
        if not len(voxels):
            return
        vertices, faces = skin(voxels, voxel_size_m)
        self._skin = self._scene.add_mesh_simple(
            "/skin", vertices, faces, color=_SKIN, flat_shading=True, side="front"
        )

    def _draw_clearance(
        self, voxels: NDArray[np.int64], voxel_size_m: float, floor_z_m: float
    ) -> None:
        if self._clearance is not None:
            self._clearance.remove()
            self._clearance = None
        if not len(voxels):
            return
        points, distance = clearance_slice(voxels, voxel_size_m, floor_z_m)
        step = np.clip(distance / CLEAR_M * 255.0, 0.0, 255.0).astype(np.uint8)
        self._clearance = self._scene.add_point_cloud(
            "/clearance",
            points,
            CIVIDIS[step],
            point_size=1.05 * voxel_size_m,
            point_shape="square",
            point_shading="flat",
            precision="float32",
        )


def skin(
    voxels: NDArray[np.int64], voxel_size_m: float
) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return the outer faces of at least one voxel: (4 Q, 3) vertices, (2 Q, 3) triangles."""
    low = voxels.min(axis=0) - 1
    size = voxels.max(axis=0) - low + 2
    solid = np.zeros(tuple(size), dtype=np.bool_)
    at = voxels - low
    solid[tuple(at.T)] = True
    quads = [
        (at[~solid[tuple((at + side).T)]] + low)[:, None, :] + _QUADS[n]
        for n, side in enumerate(_SIDES)
    ]
    corners = np.concatenate(quads).astype(np.float32) * np.float32(voxel_size_m)
    first = np.arange(len(corners), dtype=np.uint32)[:, None] * 4
    faces = np.stack(
        [first + np.array([0, 1, 2], np.uint32), first + np.array([0, 2, 3], np.uint32)], axis=1
    )
    return corners.reshape(-1, 3), faces.reshape(-1, 3)


def clearance_slice(
    voxels: NDArray[np.int64], voxel_size_m: float, floor_z_m: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return free floor points and their distances to the nearest obstacle.

    Args:
        voxels: (N, 3) surface voxels, at least one.
        voxel_size_m: Edge length of a voxel.
        floor_z_m: Height of the floor.

    Returns:
        (M, 3) points a little above the floor, and (M,) distances in metres.
    """
    height = (voxels[:, 2] + 0.5) * voxel_size_m - floor_z_m
    body = (height > BODY_LOW_M) & (height < BODY_HIGH_M)
    low = voxels[:, :2].min(axis=0)
    size = np.minimum(voxels[:, :2].max(axis=0) - low + 1, _GRID_MAX)
    floor, blocked = np.zeros(tuple(size), np.bool_), np.zeros(tuple(size), np.bool_)
    at = np.minimum(voxels[:, :2] - low, size - 1)
    floor[tuple(at[(height > -UNDERFOOT_M) & (height <= BODY_LOW_M)].T)] = True
    blocked[tuple(at[body].T)] = True
    distance: Any = distance_transform_edt(~blocked)
    cells = np.argwhere(floor & ~blocked)
    xy = (cells + low + 0.5) * voxel_size_m
    points = np.column_stack([xy, np.full(len(xy), floor_z_m + _LIFT_M)]).astype(np.float32)
    return points, (distance[tuple(cells.T)] * voxel_size_m).astype(np.float32)
