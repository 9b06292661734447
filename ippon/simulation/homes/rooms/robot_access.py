"""Removal of furniture that blocks the robot, and selection of start poses."""

import math

import numpy as np
from numpy.typing import NDArray

from ippon.simulation.camera.line_of_sight import LineOfSight
from ippon.simulation.homes.config import HomeConfig
from ippon.simulation.homes.furniture.style import uniform
from ippon.simulation.homes.layout.building_shell import HomePlan, PlacedObject
from ippon.simulation.homes.layout.openings import Opening
from ippon.simulation.homes.layout.rect import Rect
from ippon.simulation.homes.rooms.placement import Placed
from ippon.simulation.robot.navigation_grid import (
    CELL_M,
    FloorCells,
    NavigationGrid,
    grid_of_triangles,
)
from ippon.simulation.scene import Scene, StartPose

_MAX_REMOVED = 30
_GOALS = ("bed", "chair", "plant", "sofa", "toilet", "tv")
_ENCLOSED_M2 = 0.5
"""Largest free floor area that may be enclosed by furniture."""

_SPARE = ("chair", "plant")
_REACH_M = 0.75
"""Largest distance from the robot's centre to furniture that is searched for."""
_EYE_M = 1.25


def make_room_for_robot(
    plan: HomePlan, shell: list[PlacedObject], placed: list[Placed], config: HomeConfig
) -> list[Placed] | None:
    """Remove optional furniture until the robot reaches every room and the large furniture.

    Args:
        plan: The rooms and their doors.
        shell: Walls, floors and doors.
        placed: Furniture and small objects.
        config: Body of the robot.

    Returns:
        The remaining objects, or None if removal does not help.
    """
    walls = np.concatenate([t.mesh.vertices[t.mesh.faces] for t in shell])
    sheet = FloorCells.under(walls, config.max_step_m, CELL_M)
    heights = config.max_step_m, config.body_height_m
    no_floor = ~sheet.floor(walls, config.max_step_m)
    # Number of objects over each cell, so that single ones can be removed.
    count = sheet.cells_between(walls, *heights).astype(np.int16)
    taken_by: dict[int, NDArray[np.bool_]] = {}
    for p in placed:
        mesh = p.mesh()
        taken_by[id(p)] = sheet.cells_between(mesh.vertices[mesh.faces], *heights)
        count += taken_by[id(p)]
    kept = list(placed)
    for _ in range(_MAX_REMOVED):
        grid = sheet.grid((count > 0) | no_floor, config.passage_radius_m)
        problem = _first_problem(plan, kept, grid, config)
        if problem is None:
            return kept
        # An unreachable chair or plant is removed itself, not the table in front of it.
        own = [p for p in kept if p.rect is problem and p.optional and p.model.category in _SPARE]
        culprit = own[0] if own else _nearest_optional(kept, problem)
        if culprit is None:
            return None
        gone = [p for p in kept if p is culprit or _goes_with(p, culprit)]
        for p in gone:
            count -= taken_by[id(p)]
        left = {id(p) for p in gone}
        kept = [p for p in kept if id(p) not in left]
    return None


def _first_problem(
    plan: HomePlan, kept: list[Placed], grid: NavigationGrid, config: HomeConfig
) -> Rect | None:
    """Return an unreachable doorway, room, piece of furniture or patch of floor."""
    counts = np.bincount(grid.region.ravel())
    counts[0] = 0
    main = int(np.argmax(counts))
    for o in plan.openings:
        if o.kind in ("door", "passage"):
            spot = _doorway(o)
            if not _reaches(grid, main, spot, 0.12):
                return spot.grown(0.3)
    for k in range(len(plan.rooms)):
        floor = plan.interior(k)
        i0, j0 = grid.cell_at(floor.x0, floor.y0)
        i1, j1 = grid.cell_at(floor.x1, floor.y1)
        if np.count_nonzero(grid.region[i0:i1, j0:j1] == main) * grid.cell_m**2 < 0.3:
            return floor
    for p in kept:
        searched = p.model.category in _GOALS or p.model.label == "hat"
        if searched and not _reaches(grid, main, p.rect, _REACH_M, plan.interior(p.room)):
            return p.rect
    for k in np.flatnonzero(counts * grid.cell_m**2 > _ENCLOSED_M2).tolist():
        if k != main:
            points = grid.points_of(np.argwhere(grid.region == k))
            (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
            return Rect(float(x0), float(y0), float(x1), float(y1)).grown(config.passage_radius_m)
    return None


def _doorway(o: Opening) -> Rect:
    m = 0.5 * (o.low + o.high)
    return Rect(m, o.line, m, o.line) if o.along_x else Rect(o.line, m, o.line, m)


def _reaches(
    grid: NavigationGrid, region: int, rect: Rect, within_m: float, room: Rect | None = None
) -> bool:
    """Tell whether a region comes within a distance of a rectangle, in the same room."""
    near = rect.grown(within_m)
    if room is not None:
        near = near.clipped(room)
    i0, j0 = grid.cell_at(near.x0, near.y0)
    i1, j1 = grid.cell_at(near.x1, near.y1)
    window = grid.region[max(i0, 0) : i1 + 1, max(j0, 0) : j1 + 1]
    cells = np.argwhere(window == region) + np.array([max(i0, 0), max(j0, 0)])
    points = grid.points_of(cells)
    dx = np.maximum(np.maximum(rect.x0 - points[:, 0], points[:, 0] - rect.x1), 0.0)
    dy = np.maximum(np.maximum(rect.y0 - points[:, 1], points[:, 1] - rect.y1), 0.0)
    return bool(np.any(np.hypot(dx, dy) <= within_m))


def _nearest_optional(kept: list[Placed], problem: Rect) -> Placed | None:
    best, least = None, math.inf
    px, py = problem.center
    for p in kept:
        low = p.z + float(p.model.mesh.vertices[:, 2].min())
        high = p.z + float(p.model.mesh.vertices[:, 2].max())
        if not p.optional or low > 0.5 or high < 0.06 or p.rect == problem:
            continue
        cx, cy = p.rect.center
        dx = max(abs(cx - px) - 0.5 * (p.rect.width + problem.width), 0.0)
        dy = max(abs(cy - py) - 0.5 * (p.rect.depth + problem.depth), 0.0)
        distance = math.hypot(dx, dy) + 0.01 * math.hypot(cx - px, cy - py)
        if distance < least:
            best, least = p, distance
    return best if least < 2.5 else None


def _goes_with(thing: Placed, other: Placed) -> bool:
    """Tell whether an object depends on another one: it lies on it or stands at it."""
    if thing.room != other.room:
        return False
    if thing.z > 0.0:
        return thing.rect.overlaps(other.rect)
    at_table = other.model.category == "table" and thing.model.category == "chair"
    return (
        at_table and thing.model.label != "armchair" and thing.rect.overlaps(other.rect.grown(0.3))
    )


def start_poses(
    rng: np.random.Generator, scene: Scene, config: HomeConfig
) -> tuple[StartPose, ...]:
    """Choose start poses in the open, in different rooms, with random headings.

    The first is far from the hat and, where possible, from furniture that is searched for.
    """
    triangles = scene.vertices[scene.faces].astype(np.float64)
    grid = grid_of_triangles(
        triangles,
        radius_m=config.passage_radius_m,
        height_m=config.body_height_m,
        max_step_m=config.max_step_m,
    )
    counts = np.bincount(grid.region.ravel())
    counts[0] = 0
    open_floor = grid.region == int(np.argmax(counts))
    for clearance in (config.start_clearance_m, 0.8 * config.start_clearance_m, 0.0):
        cells = np.argwhere(open_floor & (grid.clearance_m >= clearance))
        if len(cells) >= 4 * config.start_count:
            break
    points = grid.points_of(cells)
    chosen: list[NDArray[np.float64]] = []
    first = _away_from_goals(rng, scene, points)
    if first is None:
        return ()
    chosen.append(first)
    while len(chosen) < config.start_count:
        # Of a few draws the one farthest from the earlier starts, to spread them.
        draws = points[rng.integers(len(points), size=4)]
        distance = [min(float(np.hypot(*(d - c))) for c in chosen) for d in draws]
        chosen.append(draws[int(np.argmax(distance))])
    return tuple(
        StartPose(
            x=round(float(p[0]), 3),
            y=round(float(p[1]), 3),
            z=0.0,
            yaw=round(uniform(rng, -math.pi, math.pi), 3),
        )
        for p in chosen
    )


def _away_from_goals(
    rng: np.random.Generator,
    scene: Scene,
    points: NDArray[np.float64],
) -> NDArray[np.float64] | None:
    """Choose a point without view of the hat, of several the one farthest from any goal."""
    goals = [i for i in scene.instances if i.category in _GOALS]
    hat = [k for k, i in enumerate(scene.instances) if i.label == "hat"]
    hat_corners = scene.vertices[scene.faces[np.isin(scene.face_instance, hat)].ravel()]
    sight = LineOfSight(scene)
    best, farthest = None, -1.0
    for point in points[rng.permutation(len(points))[:60]]:
        distance = min(_distance_to_box(point, g.aabb_min, g.aabb_max) for g in goals)
        if distance <= farthest:
            continue
        eye = np.array([point[0], point[1], _EYE_M])
        if hat and sight.is_clear(eye, hat_corners.astype(np.float64)).any():
            continue
        best, farthest = point, distance
        if farthest > 2.0:
            break
    return best


def _distance_to_box(
    point: NDArray[np.float64], low: tuple[float, ...], high: tuple[float, ...]
) -> float:
    dx = max(low[0] - point[0], point[0] - high[0], 0.0)
    dy = max(low[1] - point[1], point[1] - high[1], 0.0)
    return math.hypot(dx, dy)
