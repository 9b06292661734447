"""Overlays of the scene: painted regions, far evidence, and highlights of clicks."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.messages.driving import PaintedStroke
from app.view.colors import CERTAIN_BRUSH, FAR_EVIDENCE, NEVER_BRUSH, ROBOT, Rgb, linear

_LIFT_M: Final = 0.035
_ABOVE_M: Final = 0.11
"""Height above floor voxels of 10 cm."""
_SPOKES: Final = 28
_MAX_BOXES: Final = 2500
_Sheet = tuple[NDArray[np.float32], NDArray[np.uint32]]
"""Vertices and faces."""
_MAX_CELLS: Final = 4000
_FAR_EVIDENCE: Final = (("faint", 0.25, -math.inf, 2.0), ("strong", 0.55, 2.0, math.inf))
"""Names, opacities, and ranges of evidence in nat."""
_CUBE: Final = np.array(
    [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], dtype=np.float32
)
_FACES: Final = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ],
    dtype=np.uint32,
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Highlight:
    """Highlight after a click or a preview."""

    seen: NDArray[np.float32]
    """(M, 3) centres of voxels, metres."""
    at: tuple[float, float, float] | None = None
    """Centre of the voxel or viewpoint that was clicked."""
    then: tuple[float, float, float] | None = None
    """Next viewpoint of a preview, on the floor."""
    voxel_size_m: float = 0.08


NOTHING: Final = Highlight(seen=np.empty((0, 3), np.float32))


class OverlayLayer:
    """Draws overlays under fixed node names."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._sheets: dict[str, Any] = {}
        self._seen: Any = None
        self._rings: Any = None

    def draw_painted(self, strokes: Sequence[PaintedStroke], floor_z_m: float) -> None:
        """Draw painted regions as translucent sheets."""
        for kind, color, lift in (
            ("look_here", CERTAIN_BRUSH, _LIFT_M),
            ("not_here", NEVER_BRUSH, 1.4 * _LIFT_M),
        ):
            chosen = [stroke for stroke in strokes if stroke.kind == kind]
            sheet = _discs(chosen, floor_z_m + lift) if chosen else None
            self._lay(f"/painted/{kind}", sheet, color, 0.42)

    def draw_far_evidence(
        self, cells: Sequence[tuple[float, float, float]], cell_m: float, floor_z_m: float
    ) -> None:
        """Draw evidence from beyond the map's range as translucent sheets."""
        half = np.float32(0.5 * cell_m)
        for name, opacity, low, high in _FAR_EVIDENCE:
            chosen = [(x, y) for x, y, nat in cells[:_MAX_CELLS] if low <= nat < high]
            middle = np.array(chosen, np.float32)
            edges = (middle - half, middle + half, floor_z_m + 1.15 * _ABOVE_M)
            sheet = _rectangles(*edges) if chosen else None
            self._lay(f"/far_evidence/{name}", sheet, FAR_EVIDENCE, opacity)

    def _lay(self, name: str, sheet: _Sheet | None, color: Rgb, opacity: float) -> None:
        """Replace a sheet; None removes it."""
        old = self._sheets.pop(name, None)
        if old is not None:
            old.remove()
        if sheet is not None:
            self._sheets[name] = self._scene.add_mesh_simple(
                name,
                *sheet,
                color=color,
                opacity=opacity,
                side="double",
                flat_shading=True,
                cast_shadow=False,
                receive_shadow=False,
            )

    def draw_highlight(self, highlight: Highlight) -> None:
        """Highlight the clicked place and the voxels visible from it."""
        self._draw_seen(highlight)
        rings = [
            _ring(point, radius)
            for point, radius in ((highlight.at, 0.16), (highlight.then, 0.32))
            if point is not None
        ]
        if self._rings is not None:
            self._rings.remove()
            self._rings = None
        if rings:
            segments = np.concatenate(rings)
            colors = np.broadcast_to(np.array([255, 255, 255], np.uint8), segments.shape)
            self._rings = self._scene.add_line_segments(
                "/pointed/rings", segments, np.array(colors), thickness=0.03
            )

    def _draw_seen(self, highlight: Highlight) -> None:
        centers = highlight.seen
        if len(centers) > _MAX_BOXES:
            centers = centers[:: math.ceil(len(centers) / _MAX_BOXES)]
        if self._seen is not None:
            self._seen.remove()
            self._seen = None
        if len(centers):
            self._seen = self._scene.add_batched_meshes_simple(
                "/pointed/seen",
                _CUBE * np.float32(1.08 * highlight.voxel_size_m),
                _FACES,
                np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (len(centers), 1)),
                centers,
                batched_colors=np.tile(linear(np.array(ROBOT, np.uint8)), (len(centers), 1)),
                batched_opacities=np.full(len(centers), 0.55, np.float32),
                flat_shading=True,
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )


def _rectangles(low: NDArray[np.float32], high: NDArray[np.float32], z: float) -> _Sheet:
    """Return a mesh of rectangles at one height, from (N, 2) least and greatest x and y."""
    corners = [low, np.column_stack([high[:, 0], low[:, 1]])]
    corners += [high, np.column_stack([low[:, 0], high[:, 1]])]
    flat = np.stack(corners, axis=1).reshape(-1, 2)
    vertices = np.column_stack([flat, np.full(len(flat), z, np.float32)])
    first = 4 * np.arange(len(low), dtype=np.uint32)[:, None, None]
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32) + first
    return vertices, faces.reshape(-1, 3)


def _discs(strokes: Sequence[PaintedStroke], z: float) -> _Sheet:
    angle = np.linspace(0.0, 2.0 * math.pi, _SPOKES, endpoint=False)
    fan = np.array([[0, 1 + n, 1 + (n + 1) % _SPOKES] for n in range(_SPOKES)], dtype=np.uint32)
    vertices: list[NDArray[np.float32]] = []
    faces: list[NDArray[np.uint32]] = []
    for stroke in strokes:
        for x, y in stroke.strokes:
            rim = np.stack(
                [x + stroke.radius_m * np.cos(angle), y + stroke.radius_m * np.sin(angle)], axis=1
            )
            flat = np.vstack([[[x, y]], rim])
            faces.append(fan + np.uint32(len(vertices) * (_SPOKES + 1)))
            vertices.append(np.column_stack([flat, np.full(len(flat), z)]).astype(np.float32))
    return np.concatenate(vertices), np.concatenate(faces)


def _ring(center: tuple[float, float, float], radius_m: float) -> NDArray[np.float32]:
    angle = np.linspace(0.0, 2.0 * math.pi, 25)
    x, y, z = center
    points = np.stack(
        [x + radius_m * np.cos(angle), y + radius_m * np.sin(angle), np.full(25, z + 0.05)], axis=1
    ).astype(np.float32)
    return np.stack([points[:-1], points[1:]], axis=1)
