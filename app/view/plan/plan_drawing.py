"""The plan as a drawing (SVG), in metres, with names as text."""

import math
from collections.abc import Iterator
from html import escape

import numpy as np

from app.view.colors import CERTAIN_BRUSH, FOUND, NEVER_BRUSH, ROBOT, hex_of
from app.view.model.scene_model import SceneModel
from app.view.plan.plan_cells import Cell, PlanCells
from app.view.plan.plan_scene import PlanScene, cells_of, plan_scene
from app.view.plan.sheet import (
    BAR_TEXT_M,
    BODY_M,
    CELL_COLORS,
    PALE,
    TEXT,
    Sheet,
    lines_of,
    placed_texts,
    scale_bar_m,
)
from app.view.words import Words


def plan_svg(model: SceneModel, say: Words) -> bytes | None:
    """Return the plan as SVG; None without a map."""
    cells = cells_of(model)
    if cells is None:
        return None
    scene, sheet = plan_scene(model), Sheet(cells)
    wide, high = f"{sheet.width_m:.3f}", f"{sheet.height_m:.3f}"
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high}" width="{wide}cm" '
        f'height="{high}cm" font-family="sans-serif">'
    )
    ground = f'<rect width="100%" height="100%" fill="{hex_of(CELL_COLORS[Cell.UNKNOWN])}"/>'
    parts = [head, ground, *_cells(cells, sheet), *_scene(scene, sheet), *_texts(scene, sheet, say)]
    return "\n".join([*parts, _bar(sheet), "</svg>"]).encode()


def _cells(cells: PlanCells, sheet: Sheet) -> Iterator[str]:
    for cell in (Cell.FLOOR, Cell.FURNITURE, Cell.WALL):
        runs = "".join(
            f"M{u:.3f} {v:.3f}h{run:.3f}v{cells.cell_m:.3f}h-{run:.3f}z"
            for u, v, run in _runs(cells, cell, sheet)
        )
        if runs:
            fill = hex_of(CELL_COLORS[cell])
            yield f'<path id="{cell.name.lower()}" fill="{fill}" d="{runs}"/>'


def _scene(scene: PlanScene, sheet: Sheet) -> Iterator[str]:
    for stroke in scene.painted:
        color = hex_of(CERTAIN_BRUSH if stroke.kind == "look_here" else NEVER_BRUSH)
        # Discs that overlap are one area of one tone.
        yield f'<g fill="{color}" opacity="0.28">'
        for x, y in stroke.strokes:
            yield _circle(sheet, x, y, stroke.radius_m, "")
        yield "</g>"
    for points, color, width_m in lines_of(scene):
        line = " ".join("{:.3f},{:.3f}".format(*sheet.place(x, y)) for x, y in points)
        stroke = f'stroke="{hex_of(color)}" stroke-width="{width_m}"'
        yield f'<polyline points="{line}" fill="none" {stroke}/>'
    if scene.robot is not None:
        x, y, yaw = scene.robot
        u, v = sheet.place(x, y)
        s, t = sheet.place(x + BODY_M * math.cos(yaw), y + BODY_M * math.sin(yaw))
        yield _circle(sheet, x, y, BODY_M, f'fill="{hex_of(ROBOT)}"')
        line = f"M{u:.3f} {v:.3f}L{s:.3f} {t:.3f}"
        yield f'<path d="{line}" stroke="{hex_of(TEXT)}" stroke-width="0.05"/>'
    if scene.find is not None:
        x, y, _ = scene.find
        style = f'fill="none" stroke="{hex_of(FOUND)}" stroke-width="0.05"'
        yield _circle(sheet, x, y, 0.2, style)


def _texts(scene: PlanScene, sheet: Sheet, say: Words) -> Iterator[str]:
    for name in placed_texts(scene, say):
        u, v = sheet.place(name.x_m, name.y_m)
        place = f'x="{u:.3f}" y="{v + 0.35 * name.size_m:.3f}" font-size="{name.size_m}"'
        style = f'text-anchor="middle" fill="{hex_of(TEXT)}"'
        yield f"<text {place} {style}>{escape(name.text)}</text>"


def _bar(sheet: Sheet) -> str:
    length = scale_bar_m(sheet.width_m)
    left, low = sheet.bar_at
    color = hex_of(PALE)
    line = f'<path d="M{left:.3f} {low:.3f}h{length:g}" stroke="{color}" stroke-width="0.06"/>'
    place = f'x="{left + length + 0.12:.3f}" y="{low + 0.09:.3f}" font-size="{BAR_TEXT_M}"'
    return f'{line}<text {place} fill="{color}">{length:g} m</text>'


def _circle(sheet: Sheet, x: float, y: float, radius_m: float, style: str) -> str:
    u, v = sheet.place(x, y)
    return f'<circle cx="{u:.3f}" cy="{v:.3f}" r="{radius_m:.3f}" {style}/>'


def _runs(cells: PlanCells, cell: Cell, sheet: Sheet) -> Iterator[tuple[float, float, float]]:
    """Yield left, top and length of the rows of equal cells, on the sheet."""
    for j in range(cells.cells.shape[1]):
        row = np.concatenate([[False], cells.cells[:, j] == cell, [False]])
        edges = np.flatnonzero(row[1:] != row[:-1])
        x0, y0 = cells.origin_m
        for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            u, v = sheet.place(x0 + start * cells.cell_m, y0 + (j + 1) * cells.cell_m)
            yield u, v, (stop - start) * cells.cell_m
