"""Exports of the live view: map, trail and plotted figures."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.view.colors import NOT_MAPPED, OOI_SCALE
from app.view.model.scene_model import SceneModel
from app.view.plan.plan_drawing import plan_svg
from app.view.plan.plan_files import plan_cells_json, plan_json, plan_pgm, plan_yaml
from app.view.plan.plan_picture import plan_png
from app.view.words import Words

Writer = Callable[[SceneModel, Words], bytes | None]
"""Writes a file from the model; the words are for pictures, data has the labels."""

_POINT: Final = np.dtype(
    [
        *((name, "<f4") for name in ("x", "y", "z")),
        *((name, "u1") for name in ("red", "green", "blue")),
        ("object_probability", "<f4"),
        ("thing", "u1"),
    ]
)
_PLY_TYPES: Final = {"<f4": "float", "|u1": "uchar"}
_FIGURES: Final = (
    "time_s", "best_match", "explored_m2", "path_m", "step_ms", "picture_to_command_ms",
)  # fmt: skip


def map_ply(model: SceneModel) -> bytes | None:
    """Return the surface voxels as a binary PLY, None without a map.

    A point has the centre of a voxel in metres, its camera colour, its probability of being the
    object (-1 if unknown), and the row of its most probable label, which the comments name.
    """
    indices, attributes = model.voxels.all_voxels()
    if model.voxel_size_m is None or not len(indices):
        return None
    points = np.empty(len(indices), _POINT)
    for axis, name in enumerate("xyz"):
        points[name] = (indices[:, axis] + 0.5) * model.voxel_size_m
    for channel, name in enumerate(("red", "green", "blue")):
        points[name] = attributes[:, channel]
    stored = attributes[:, 3]
    points["object_probability"] = np.where(stored == NOT_MAPPED, -1.0, stored / OOI_SCALE)
    points["thing"] = attributes[:, 6]
    rows = model.proximity.rows if model.proximity is not None else []
    things = [f"comment thing {n}: {_plain(row.label)}" for n, row in enumerate(rows)]
    fields = [f"property {_PLY_TYPES[_POINT[name].str]} {name}" for name in _POINT.names or ()]
    head = ["ply", "format binary_little_endian 1.0", *things]
    head += [f"element vertex {len(points)}", *fields, "end_header", ""]
    return "\n".join(head).encode("ascii") + points.tobytes()


def trail_csv(model: SceneModel) -> bytes | None:
    """Return the robot's positions every 5 cm, in metres; None before its first pose."""
    if not model.trail_world:
        return None
    return _csv(("x_m", "y_m", "z_m"), np.array(model.trail_world))


def figures_csv(model: SceneModel) -> bytes | None:
    """Return the plotted figures; None before the first status."""
    rows = model.history.columns().T
    return _csv(_FIGURES, rows) if len(rows) else None


def _wordless(write: Callable[[SceneModel], bytes | None]) -> Writer:
    return lambda model, _: write(model)


FILES: Final[dict[str, tuple[str, Writer]]] = {
    "map.ply": ("application/octet-stream", _wordless(map_ply)),
    "trail.csv": ("text/csv", _wordless(trail_csv)),
    "figures.csv": ("text/csv", _wordless(figures_csv)),
    "plan.png": ("image/png", plan_png),
    "plan.svg": ("image/svg+xml", plan_svg),
    "plan.pgm": ("image/x-portable-graymap", _wordless(plan_pgm)),
    "plan.yaml": ("application/yaml", _wordless(plan_yaml)),
    "plan.json": ("application/json", _wordless(plan_json)),
    "plan-cells.json": ("application/json", _wordless(plan_cells_json)),
}
"""Media type and writer by file name."""


def _csv(names: tuple[str, ...], rows: NDArray[np.float64]) -> bytes:
    lines = [",".join(f"{value:.6g}" for value in row) for row in rows.tolist()]
    return "\n".join([",".join(names), *lines, ""]).encode("ascii")


def _plain(text: str) -> str:
    """Reduce a text to one line of an ASCII header."""
    return "".join(c if c.isascii() and c.isprintable() else "?" for c in text)
