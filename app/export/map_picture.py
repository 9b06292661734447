"""The map from above, with the robot's trajectory and finds."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from app.view.colors import FOUND, ORANGE, ROBOT
from app.view.model.attribute_colors import AttributeColor, attribute_colors
from app.view.model.scene_model import SceneModel
from app.view.model.voxel_store import ATTRIBUTES

GROUND: Final = (13, 17, 23)
CEILING_M: Final = 1.4
"""Height above the floor from which nothing is shown."""
MARGIN_PX: Final = 16
_PLACE_M: Final = 0.4
"""Edge of the mark of a find whose size is not known any more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureExtent:
    """Part of the floor that a picture shows."""

    low: tuple[float, float]
    """x and y of the lower left corner, metres."""
    pixels_per_m: float
    size: tuple[int, int]
    """Width and height in pixels, both even, as video requires."""

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return the pixel of a point on the floor."""
        u = MARGIN_PX + (x - self.low[0]) * self.pixels_per_m
        v = self.size[1] - MARGIN_PX - (y - self.low[1]) * self.pixels_per_m
        return u, v


def extent_of(indices: NDArray[np.int64], voxel_m: float, longest_px: int) -> PictureExtent:
    """Return the extent that shows all of a map."""
    low = indices[:, :2].min(axis=0) * voxel_m
    extent = (indices[:, :2].max(axis=0) + 1) * voxel_m - low
    scale = (longest_px - 2 * MARGIN_PX) / max(float(extent.max()), 1.0)
    width, height = (2 * math.ceil((e * scale + 2 * MARGIN_PX) / 2) for e in extent.tolist())
    return PictureExtent(
        low=(float(low[0]), float(low[1])), pixels_per_m=scale, size=(width, height)
    )


class MapFromAbove:
    """Picture of the highest voxels below the ceiling, updated as voxels change."""

    def __init__(
        self,
        indices: NDArray[np.int64],
        voxel_m: float,
        frame: PictureExtent,
        mode: AttributeColor = "camera",
        *,
        floor_z_m: float,
    ) -> None:
        """Create an empty picture.

        Args:
            indices: (N, 3) voxels that bound the drawing.
            voxel_m: Edge length of a voxel.
            frame: Extent of the picture.
            mode: Colour mode.
            floor_z_m: Height of the floor.
        """
        self._voxel_m, self._frame, self._floor_z_m = voxel_m, frame, floor_z_m
        self._mode: AttributeColor = mode
        self._low = indices.min(axis=0)
        size = indices.max(axis=0) - self._low + 1
        below = math.ceil((floor_z_m + CEILING_M) / voxel_m - 0.5) - int(self._low[2])
        size[2] = max(1, min(int(size[2]), below))
        self._size = size
        self._solid = np.zeros(tuple(size), np.bool_)
        self._attributes = np.zeros((*size, ATTRIBUTES), np.uint8)
        self._cells = np.full((int(size[1]), int(size[0]), 3), GROUND, np.uint8)

    def clear(self) -> None:
        """Remove every voxel."""
        self._solid[:] = False
        self._cells[:] = GROUND

    def take(
        self,
        indices: NDArray[np.int64],
        attributes: NDArray[np.uint8],
        surface: NDArray[np.bool_] | None = None,
    ) -> None:
        """Update voxels; those that are no longer surface are removed.

        Args:
            indices: (N, 3).
            attributes: (N, 8), as `VoxelStore` keeps them.
            surface: (N,) whether each is surface; None for all.
        """
        at = indices - self._low
        inside = ((at >= 0) & (at < self._size)).all(axis=1)
        i, j, k = at[inside].T
        self._solid[i, j, k] = True if surface is None else surface[inside]
        self._attributes[i, j, k] = attributes[inside]
        height = int(self._size[1])
        self._color(*np.divmod(np.unique(i * height + j), height))

    def _color(self, i: NDArray[np.int64], j: NDArray[np.int64]) -> None:
        self._cells[j, i] = GROUND
        columns = self._solid[i, j]
        filled = columns.any(axis=1)
        i, j = i[filled], j[filled]
        top = columns.shape[1] - 1 - np.argmax(columns[filled, ::-1], axis=1)
        indices = np.stack([i, j, top], axis=1) + self._low
        colors = attribute_colors(
            indices, self._attributes[i, j, top], self._voxel_m, self._mode, self._floor_z_m
        )
        # Higher voxels are lighter, so that furniture contrasts with the floor.
        floor = self._floor_z_m / CEILING_M
        rise = np.clip((indices[:, 2:] + 1) * (self._voxel_m / CEILING_M) - floor, 0.0, 1.0)
        self._cells[j, i] = (colors * (0.72 + 0.28 * rise)).astype(np.uint8)

    def image(self) -> Image.Image:
        """Return the picture."""
        image = Image.new("RGB", self._frame.size, GROUND)
        low, high = self._low * self._voxel_m, (self._low + self._size) * self._voxel_m
        u0, v1 = self._frame.place(float(low[0]), float(low[1]))
        u1, v0 = self._frame.place(float(high[0]), float(high[1]))
        box = (max(1, round(u1 - u0)), max(1, round(v1 - v0)))
        patch = Image.fromarray(self._cells[::-1]).resize(box, Image.Resampling.NEAREST)
        image.paste(patch, (round(u0), round(v0)))
        return image


def draw_map(
    scene: SceneModel,
    frame: PictureExtent,
    mode: AttributeColor = "camera",
    found: Sequence[tuple[float, float, float]] = (),
) -> NDArray[np.uint8]:
    """Return the scene from above, (H, W, 3).

    Args:
        scene: With the map.
        frame: Extent of the picture.
        mode: Colour mode.
        found: Where the searches of the session have found something, metres in the world.
    """
    image = Image.new("RGB", frame.size, GROUND)
    indices, attributes = scene.voxels.all_voxels()
    if scene.voxel_size_m is not None and len(indices):
        above = MapFromAbove(indices, scene.voxel_size_m, frame, mode, floor_z_m=scene.floor_z_m)
        above.take(indices, attributes)
        image = above.image()
    return draw_things(image, scene, frame, found)


def draw_things(
    image: Image.Image,
    scene: SceneModel,
    frame: PictureExtent,
    found: Sequence[tuple[float, float, float]] = (),
) -> NDArray[np.uint8]:
    """Return a map with the robot, its trajectory and its finds drawn over it, (H, W, 3)."""
    draw = ImageDraw.Draw(image)
    points = [frame.place(x, y) for x, y, _ in scene.trail_world]
    if len(points) > 1:
        draw.line(points, fill=ROBOT, width=3)
    _draw_finds(draw, scene, frame, found)
    if scene.T_world_base is not None:
        _draw_robot(draw, scene.T_world_base, frame)
    return np.asarray(image)


def _draw_finds(
    draw: ImageDraw.ImageDraw,
    scene: SceneModel,
    frame: PictureExtent,
    found: Sequence[tuple[float, float, float]],
) -> None:
    boxes = [(d.center_world, d.size_m, ORANGE) for d in scene.detections]
    report = scene.status.find if scene.status is not None else None
    if report is not None:
        boxes.append((report.position_world, report.size_m, FOUND))
    known = report.position_world if report is not None else None
    boxes += [(place, (_PLACE_M,) * 3, FOUND) for place in found if place != known]
    for center, size, color in boxes:
        half_x, half_y = 0.5 * size[0] + 0.08, 0.5 * size[1] + 0.08
        u0, v0 = frame.place(center[0] - half_x, center[1] + half_y)
        u1, v1 = frame.place(center[0] + half_x, center[1] - half_y)
        draw.rectangle((u0, v0, u1, v1), outline=color, width=3)


def _draw_robot(
    draw: ImageDraw.ImageDraw, T_world_base: NDArray[np.float64], frame: PictureExtent
) -> None:
    x, y = T_world_base[:2, 3].tolist()
    radius = 0.25 * frame.pixels_per_m
    u, v = frame.place(x, y)
    draw.ellipse((u - radius, v - radius, u + radius, v + radius), fill=ROBOT)
    tip = T_world_base[:2, 3] + 0.25 * T_world_base[:2, 0]
    draw.line([(u, v), frame.place(*tip.tolist())], fill=GROUND, width=3)
