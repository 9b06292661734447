"""The plan as data: for the page as JSON, for ROS as PGM and YAML."""

from typing import Final

import msgspec
import numpy as np

from app.view.model.scene_model import SceneModel
from app.view.plan.plan_scene import cells_of, plan_scene

PGM_NAME: Final = "ippon-plan.pgm"
"""Name that a browser saves the PGM under; the YAML refers to it."""


def plan_json(model: SceneModel) -> bytes | None:
    """Return what the page draws over the cells; None without a map."""
    if model.voxels.count == 0 or model.voxel_size_m is None:
        return None
    return msgspec.json.encode(plan_scene(model))


class CellsFile(msgspec.Struct, frozen=True, kw_only=True):
    """Cells for the page."""

    revision: int
    origin_m: tuple[float, float]
    cell_m: float
    size: tuple[int, int]
    """Number of cells along x and y."""
    packed: bytes
    """See `PlanCells.packed`; base64 in JSON."""


def plan_cells_json(model: SceneModel) -> bytes | None:
    """Return the cells for the page; None without a map."""
    cells = cells_of(model)
    if cells is None:
        return None
    return msgspec.json.encode(
        CellsFile(
            revision=model.voxels.revision,
            origin_m=cells.origin_m,
            cell_m=cells.cell_m,
            size=(cells.cells.shape[0], cells.cells.shape[1]),
            packed=cells.packed(),
        )
    )


def plan_pgm(model: SceneModel) -> bytes | None:
    """Return the map of ROS `map_server`: 0 occupied, 254 free, 205 unknown; y up."""
    cells = cells_of(model)
    if cells is None:
        return None
    values = np.array([205, 254, 0, 0], np.uint8)[cells.cells]
    rows = np.ascontiguousarray(values.T[::-1])
    return b"P5\n%d %d\n255\n" % (rows.shape[1], rows.shape[0]) + rows.tobytes()


def plan_yaml(model: SceneModel) -> bytes | None:
    """Return the YAML that belongs to `plan_pgm`."""
    cells = cells_of(model)
    if cells is None:
        return None
    x, y = cells.origin_m
    return (
        f"image: {PGM_NAME}\nmode: trinary\nresolution: {cells.cell_m:.6g}\n"
        f"origin: [{x:.6g}, {y:.6g}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    ).encode("ascii")
