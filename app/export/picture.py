"""The map from above, with the robot's way and what it found."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from app.export.geometry import ExportColor, colors_of
from app.messages.scene import Detection
from app.view.colors import FOUND, ORANGE, ROBOT
from app.view.scene_model import SceneModel

GROUND: Final = (13, 17, 23)
CEILING_M: Final = 1.4
MARGIN_PX: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """What part of the floor a picture shows."""

    low: tuple[float, float]
    """x and y of the lower left corner, metres."""
    pixels_per_m: float
    size: tuple[int, int]
    """Width and height; both even, as video wants them."""

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return the pixel of a point on the floor."""
        u = MARGIN_PX + (x - self.low[0]) * self.pixels_per_m
        v = self.size[1] - MARGIN_PX - (y - self.low[1]) * self.pixels_per_m
        return u, v


def frame_of(indices: NDArray[np.int64], voxel_m: float, longest_px: int) -> Frame:
    """Return the picture that shows all of a map."""
    low = indices[:, :2].min(axis=0) * voxel_m
    extent = (indices[:, :2].max(axis=0) + 1) * voxel_m - low
    scale = (longest_px - 2 * MARGIN_PX) / max(float(extent.max()), 1.0)
    width, height = (2 * math.ceil((e * scale + 2 * MARGIN_PX) / 2) for e in extent.tolist())
    return Frame(low=(float(low[0]), float(low[1])), pixels_per_m=scale, size=(width, height))


def draw_map(
    scene: SceneModel, frame: Frame, mode: ExportColor = "camera", trail_to: int | None = None
) -> NDArray[np.uint8]:
    """Draw what the scene shows, seen from above, (H, W, 3)."""
    image = Image.new("RGB", frame.size, GROUND)
    indices, attributes = scene.voxels.all_voxels()
    voxel_m = scene.voxel_size_m
    if voxel_m is not None and len(indices):
        image = _voxels(indices, attributes, voxel_m, frame, mode)
    draw = ImageDraw.Draw(image)
    trail = scene.trail_world if trail_to is None else scene.trail_world[:trail_to]
    points = [frame.place(x, y) for x, y, _ in trail]
    if len(points) > 1:
        draw.line(points, fill=ROBOT, width=3, joint="curve")
    _draw_finds(draw, scene, frame, scene.detections)
    if scene.T_world_base is not None:
        _draw_robot(draw, scene.T_world_base, frame)
    return np.asarray(image)


def _voxels(
    indices: NDArray[np.int64],
    attributes: NDArray[np.uint8],
    voxel_m: float,
    frame: Frame,
    mode: ExportColor,
) -> Image.Image:
    below = (indices[:, 2] + 0.5) * voxel_m < CEILING_M
    indices, attributes = indices[below], attributes[below]
    order = np.argsort(indices[:, 2], kind="stable")
    indices, attributes = indices[order], attributes[order]
    colors = colors_of(indices, attributes, voxel_m, mode).astype(np.float32)
    # Higher is lighter, so that furniture stands out from the floor.
    rise = np.clip((indices[:, 2:] + 1) * (voxel_m / CEILING_M), 0.0, 1.0).astype(np.float32)
    shade = np.float32(0.72) + np.float32(0.28) * rise
    low = indices[:, :2].min(axis=0) if len(indices) else np.zeros(2, np.int64)
    size = (indices[:, :2].max(axis=0) - low + 1) if len(indices) else np.ones(2, np.int64)
    cells = np.zeros((int(size[1]), int(size[0]), 3), np.uint8)
    cells[:] = GROUND
    # Of voxels above one another the highest is written last.
    cells[indices[:, 1] - low[1], indices[:, 0] - low[0]] = (colors * shade).astype(np.uint8)
    u0, v1 = frame.place(*(low * voxel_m).tolist())
    u1, v0 = frame.place(*((low + size) * voxel_m).tolist())
    image = Image.new("RGB", frame.size, GROUND)
    box = (max(1, round(u1 - u0)), max(1, round(v1 - v0)))
    patch = Image.fromarray(cells[::-1]).resize(box, Image.Resampling.NEAREST)
    image.paste(patch, (round(u0), round(v0)))
    return image


def _draw_finds(
    draw: ImageDraw.ImageDraw, scene: SceneModel, frame: Frame, finds: Sequence[Detection]
) -> None:
    boxes = [(d.center_world, d.size_m, ORANGE) for d in finds]
    report = scene.status.find if scene.status is not None else None
    if report is not None:
        boxes.append((report.position_world, report.size_m, FOUND))
    for center, size, color in boxes:
        half_x, half_y = 0.5 * size[0] + 0.08, 0.5 * size[1] + 0.08
        u0, v0 = frame.place(center[0] - half_x, center[1] + half_y)
        u1, v1 = frame.place(center[0] + half_x, center[1] - half_y)
        draw.rectangle((u0, v0, u1, v1), outline=color, width=3)


def _draw_robot(draw: ImageDraw.ImageDraw, T_world_base: NDArray[np.float64], frame: Frame) -> None:
    x, y = T_world_base[:2, 3].tolist()
    radius = 0.25 * frame.pixels_per_m
    u, v = frame.place(x, y)
    draw.ellipse((u - radius, v - radius, u + radius, v + radius), fill=ROBOT)
    tip = T_world_base[:2, 3] + 0.25 * T_world_base[:2, 0]
    draw.line([(u, v), frame.place(*tip.tolist())], fill=GROUND, width=3)
