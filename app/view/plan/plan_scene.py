"""Everything that the plan shows, taken from the scene model."""

from typing import Final

import msgspec
import numpy as np

from app.messages.driving import PaintedStroke
from app.messages.memory import RememberedThing, Room
from app.view.model.scene_model import SceneModel
from app.view.plan.plan_cells import PlanCells, plan_cells
from ippon.geometry import yaw_of
from ippon.vocabulary import in_words

THINGS: Final = 60
"""Most names of furniture."""
LEAST_M: Final = 0.3
"""Extent on the floor from which a thing is named."""
_TRAIL: Final = 400
_WALL: Final = "wall"


class PlanThing(msgspec.Struct, frozen=True, kw_only=True):
    """Name and box of a piece of furniture, metres in the world."""

    text: str
    """The name that a person gave it, else its label."""
    x_m: float
    y_m: float
    size_x_m: float
    size_y_m: float


class PlanScene(msgspec.Struct, frozen=True, kw_only=True):
    """What is drawn over the cells; lengths in metres, angles in radians."""

    revision: int
    """Changes with the cells."""
    explored_m2: float = 0.0
    robot: tuple[float, float, float] | None = None
    """x, y and yaw."""
    path: list[tuple[float, float]] = []
    trail: list[tuple[float, float]] = []
    find: tuple[float, float, str] | None = None
    painted: list[PaintedStroke] = []
    rooms: list[Room] = []
    things: list[PlanThing] = []


def cells_of(model: SceneModel) -> PlanCells | None:
    """Return the cells of the plan; None without a map."""
    if model.voxel_size_m is None:
        return None
    indices, attributes = model.voxels.all_voxels()
    is_wall = np.isin(attributes[:, 6], _walls_of(model))
    return plan_cells(indices, is_wall, model.voxel_size_m, model.floor_z_m)


def cells_state(model: SceneModel) -> tuple[object, ...]:
    """Return what the cells depend on: they are the same as long as it is."""
    return model.voxels.revision, model.voxel_size_m, model.floor_z_m, _walls_of(model)


def _walls_of(model: SceneModel) -> tuple[int, ...]:
    """Return the rows of the labels that are walls."""
    rows = () if model.proximity is None else model.proximity.rows
    return tuple(n for n, row in enumerate(rows) if row.label == _WALL)


def plan_scene(model: SceneModel) -> PlanScene:
    """Return what is drawn over the cells of a plan."""
    status, pose = model.status, model.T_world_base
    find = None if status is None else status.find
    return PlanScene(
        revision=model.voxels.revision,
        explored_m2=0.0 if status is None else round(status.explored_m2, 1),
        robot=None
        if pose is None
        else (float(pose[0, 3]), float(pose[1, 3]), round(yaw_of(pose), 4)),
        path=_rounded(model.path_world.tolist()),
        trail=_rounded(model.trail_world[:: 1 + len(model.trail_world) // _TRAIL]),
        find=None if find is None else (*find.position_world[:2], in_words(find.object)),
        painted=list(model.painted),
        rooms=list(model.rooms),
        things=furniture_of(model.things),
    )


def furniture_of(things: tuple[RememberedThing, ...]) -> list[PlanThing]:
    """Return the things that are named on a plan, the largest first."""
    here = [
        PlanThing(
            text=thing.name or in_words(thing.label),
            x_m=round(thing.position_world[0], 2),
            y_m=round(thing.position_world[1], 2),
            size_x_m=round(thing.size_m[0], 2),
            size_y_m=round(thing.size_m[1], 2),
        )
        for thing in things
        if thing.gone_ns == 0
        and max(thing.size_m[:2]) >= LEAST_M
        and (thing.name or thing.label not in ("", _WALL))
    ]
    here.sort(key=lambda thing: -thing.size_x_m * thing.size_y_m)
    return here[:THINGS]


def _rounded(points: list) -> list[tuple[float, float]]:
    return [(round(point[0], 3), round(point[1], 3)) for point in points]
