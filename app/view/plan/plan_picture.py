"""The plan as a picture (PNG)."""

import contextlib
import io
import logging
import math
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from app.view.colors import CERTAIN_BRUSH, FOUND, NEVER_BRUSH, ROBOT
from app.view.model.scene_model import SceneModel
from app.view.plan.plan_cells import Cell, PlanCells
from app.view.plan.plan_scene import PlanScene, cells_of, plan_scene
from app.view.plan.sheet import (
    BAR_TEXT_M,
    BODY_M,
    CELL_COLORS,
    MARGIN_M,
    PALE,
    TEXT,
    Sheet,
    lines_of,
    placed_texts,
    scale_bar_m,
)
from app.view.words import Words

logger = logging.getLogger(__name__)

PIXELS: Final = 1600
"""Longer side of the picture."""
PAINTED: Final = 70
"""Opacity of painted floor, of 255."""
FONT: Final = "resources/Roboto-Medium.ttf"
"""Font within the package open3d."""


def plan_png(model: SceneModel, say: Words) -> bytes | None:
    """Return the plan as PNG; None without a map."""
    cells = cells_of(model)
    if cells is None:
        return None
    scene, sheet = plan_scene(model), Sheet(cells)
    scale = PIXELS / max(sheet.width_m, sheet.height_m)
    image = _ground(cells, sheet, scale)
    _paint(image, scene, sheet, scale)
    pen = _Pen(ImageDraw.Draw(image, "RGBA"), sheet, scale)
    pen.draw_scene(scene)
    pen.draw_texts(scene, say)
    pen.draw_bar(scale_bar_m(sheet.width_m))
    out = io.BytesIO()
    image.save(out, "PNG")
    return out.getvalue()


def _font(size_px: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Return a font with the letters of European languages: Pillow's own has those of ASCII."""
    package = find_spec("open3d")
    folders = [] if package is None else package.submodule_search_locations or []
    for folder in folders:
        with contextlib.suppress(OSError):
            return ImageFont.truetype(Path(folder) / FONT, size_px)
    logger.warning("open3d has no %s any more: the plan shows boxes for letters like ä", FONT)
    return ImageFont.load_default(size_px)


def _ground(cells: PlanCells, sheet: Sheet, scale: float) -> Image.Image:
    size = (round(sheet.width_m * scale), round(sheet.height_m * scale))
    image = Image.new("RGB", size, CELL_COLORS[Cell.UNKNOWN])
    colors = np.array([CELL_COLORS[cell] for cell in Cell], np.uint8)
    patch = Image.fromarray(np.ascontiguousarray(colors[cells.cells.transpose()[::-1]]))
    box = (max(1, round(cells.size_m[0] * scale)), max(1, round(cells.size_m[1] * scale)))
    margin = round(MARGIN_M * scale)
    image.paste(patch.resize(box, Image.Resampling.NEAREST), (margin, margin))
    return image


def _paint(image: Image.Image, scene: PlanScene, sheet: Sheet, scale: float) -> None:
    """Draw the painted floor. Discs of one region that overlap are one area of one tone."""
    for region in scene.painted:
        color = CERTAIN_BRUSH if region.kind == "look_here" else NEVER_BRUSH
        tone = Image.new("L", image.size)
        draw, radius = ImageDraw.Draw(tone), region.radius_m * scale
        for x, y in region.strokes:
            u, v = sheet.place(x, y)
            draw.circle((u * scale, v * scale), radius, fill=PAINTED)
        image.paste(color, mask=tone)


class _Pen:
    """Draws in metres of the world."""

    def __init__(self, draw: ImageDraw.ImageDraw, sheet: Sheet, scale: float) -> None:
        self._draw, self._sheet, self._scale = draw, sheet, scale

    def _at(self, x: float, y: float) -> tuple[float, float]:
        u, v = self._sheet.place(x, y)
        return u * self._scale, v * self._scale

    def _width(self, metres: float) -> int:
        return max(2, round(metres * self._scale))

    def draw_scene(self, scene: PlanScene) -> None:
        """Draw trail, path, robot and find."""
        draw, scale = self._draw, self._scale
        for points, color, width_m in lines_of(scene):
            line = [self._at(x, y) for x, y in points]
            draw.line(line, fill=color, width=self._width(width_m))
        if scene.robot is not None:
            x, y, yaw = scene.robot
            draw.circle(self._at(x, y), BODY_M * scale, fill=ROBOT)
            tip = self._at(x + BODY_M * math.cos(yaw), y + BODY_M * math.sin(yaw))
            draw.line([self._at(x, y), tip], fill=TEXT, width=self._width(0.05))
        if scene.find is not None:
            x, y, _ = scene.find
            draw.circle(self._at(x, y), 0.2 * scale, outline=FOUND, width=self._width(0.05))

    def draw_texts(self, scene: PlanScene, say: Words) -> None:
        """Write the names."""
        for name in placed_texts(scene, say):
            self._draw.text(
                self._at(name.x_m, name.y_m),
                name.text,
                fill=TEXT,
                font=_font(name.size_m * self._scale),
                anchor="mm",
                stroke_width=max(1, round(0.02 * self._scale)),
                stroke_fill=(255, 255, 255, 200),
            )

    def draw_bar(self, length_m: float) -> None:
        """Draw the scale bar."""
        scale = self._scale
        left, low = self._sheet.bar_at
        bar = [(left * scale, low * scale), ((left + length_m) * scale, low * scale)]
        self._draw.line(bar, fill=PALE, width=self._width(0.06))
        at = ((left + length_m + 0.12) * scale, low * scale)
        font = _font(BAR_TEXT_M * scale)
        self._draw.text(at, f"{length_m:g} m", fill=PALE, font=font, anchor="lm")
