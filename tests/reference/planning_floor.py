"""The planner's floor the slow way: every column, every obstacle, every cell one by one."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import FREE, OCCUPIED, UNKNOWN, MapArrays
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.clearance import clearance_at
from ippon.planning.terrain.floor_grid import BEYOND_CUTOFF, OBSTACLE, OPEN, UNSEEN, FloorGrid
from ippon.planning.terrain.motion_check import move_between
from ippon.planning.terrain.obstacle_columns import (
    COLUMN_BLOCKED,
    COLUMN_CLEAR,
    COLUMN_UNSEEN,
    FLOOR_ABSENT,
    FLOOR_SEEN,
    HeightBands,
)
from ippon.planning.terrain.reachability import SLACK_CELLS


def state_of(arrays: MapArrays, i: int, j: int, k: int) -> int:
    block = np.array([i // 8, j // 8, k // 8]) - arrays.origin_block
    if (block < 0).any() or (block >= arrays.directory.shape).any():
        return UNKNOWN
    row = arrays.directory[tuple(block)]
    return UNKNOWN if row < 0 else int(arrays.state[row, (i % 8) * 64 + (j % 8) * 8 + k % 8])


def column(arrays: MapArrays, bands: HeightBands, i: int, j: int, min_seen: float) -> int:
    body = [state_of(arrays, i, j, k) for k in range(bands.body_low, bands.body_high + 1)]
    floor = [state_of(arrays, i, j, k) for k in range(bands.floor_low, bands.floor_high + 1)]
    below = state_of(arrays, i, j, bands.floor_low - 1)
    value = COLUMN_UNSEEN
    if OCCUPIED in body:
        value = COLUMN_BLOCKED
    elif body.count(FREE) >= min_seen * len(body):
        value = COLUMN_CLEAR
    if OCCUPIED in floor:
        value |= FLOOR_SEEN
    elif all(s == FREE for s in floor) and below != UNKNOWN:
        value |= FLOOR_ABSENT
    return value


def nearest_distance(kind: NDArray[np.uint8], value: int, i: int, j: int, cutoff: int) -> float:
    """Distance in cells to the nearest cell of a kind, infinite beyond the cut-off."""
    sites = np.argwhere(kind == value)
    if not len(sites):
        return math.inf
    d2 = int(((sites - (i, j)) ** 2).sum(axis=1).min())
    return math.sqrt(d2) if d2 <= cutoff * cutoff else math.inf


def clearance(grid: FloorGrid, obstacle_kind: int, x: float, y: float) -> float:
    """Distance from a point to the nearest obstacle centre, all obstacles tried."""
    sites = np.argwhere(grid.kind == obstacle_kind)
    limit = grid.cutoff * grid.voxel_size
    if not len(sites):
        return limit
    centres = (sites + grid.origin + 0.5) * grid.voxel_size
    return min(limit, float(np.hypot(centres[:, 0] - x, centres[:, 1] - y).min()))


def reachable(
    grid: FloorGrid, limits: BodyLimits, x: float, y: float, margin: float, comfort: float
):
    """Breadth-first search over passable cells, from those within half a metre of (x, y)."""
    nx, ny = grid.kind.shape

    def far_enough(site: NDArray[np.int16], need_m: float) -> bool:
        return (
            site[0] == BEYOND_CUTOFF or math.hypot(*site.astype(float)) >= need_m / grid.voxel_size
        )

    def passable_at(i: int, j: int) -> int:
        if grid.kind[i, j] != OPEN or not far_enough(grid.unseen[i, j], limits.unseen_radius):
            return 0
        need = limits.radius + margin
        slack = SLACK_CELLS * grid.voxel_size
        return sum(bool(far_enough(grid.obstacle[i, j], n)) for n in (need - slack, need + comfort))

    passable = np.array([[passable_at(i, j) for j in range(ny)] for i in range(nx)])
    out = np.zeros((nx, ny), dtype=np.uint8)
    queue: deque[tuple[int, int]] = deque()
    for i, j in np.argwhere(passable > 0):
        cx, cy = (np.array([i, j]) + grid.origin + 0.5) * grid.voxel_size
        if math.hypot(cx - x, cy - y) <= 0.5:
            out[i, j] = passable[i, j]
            queue.append((i, j))
    while queue:
        i, j = queue.popleft()
        for a, b in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            if 0 <= a < nx and 0 <= b < ny and passable[a, b] and not out[a, b]:
                out[a, b] = passable[a, b]
                queue.append((a, b))
    return out


def steps_over_unseen_floor(
    grid: FloorGrid,
    limits: BodyLimits,
    sure: NDArray[np.uint8],
    blocked: NDArray[np.uint8],
    x: float,
    y: float,
    margin: float,
):
    """Steps of a breadth-first search that takes unseen floor for free, -1 where none leads."""
    nx, ny = grid.kind.shape
    need = (limits.radius + margin) / grid.voxel_size - SLACK_CELLS

    def passable(i: int, j: int) -> bool:
        if sure[i, j]:
            return True
        site = grid.obstacle[i, j]
        roomy = site[0] == BEYOND_CUTOFF or math.hypot(*site.astype(float)) >= need
        return grid.kind[i, j] != OBSTACLE and not blocked[i, j] and roomy

    out = np.full((nx, ny), -1, dtype=np.int32)
    queue: deque[tuple[int, int]] = deque()
    for i, j in np.argwhere(sure > 0):
        cx, cy = (np.array([i, j]) + grid.origin + 0.5) * grid.voxel_size
        if math.hypot(cx - x, cy - y) <= 0.5:
            out[i, j] = 0
            queue.append((i, j))
    while queue:
        i, j = queue.popleft()
        for a, b in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            if 0 <= a < nx and 0 <= b < ny and out[a, b] < 0 and passable(a, b):
                out[a, b] = out[i, j] + 1
                queue.append((a, b))
    return out


def unseen_shortcut_m(
    grid: FloorGrid,
    limits: BodyLimits,
    margin_m: float,
    start: NDArray[np.float64],
    end: NDArray[np.float64],
) -> float:
    """See `ippon.planning.terrain.unseen_shortcut`: points every half cell, one after the other."""
    away = math.dist(start, end)
    steps = max(1, math.ceil(2.0 * away / grid.voxel_size))
    unseen = 0
    for n in range(steps + 1):
        x, y = start + n / steps * (end - start)
        i, j = (
            math.floor(c / grid.voxel_size) - o for c, o in zip((x, y), grid.origin, strict=True)
        )
        inside = 1 <= i < grid.kind.shape[0] - 1 and 1 <= j < grid.kind.shape[1] - 1
        room = limits.radius + margin_m
        left = math.dist(start, (x, y)) > 0.5 * room
        if inside and left and clearance(grid, OBSTACLE, x, y) < room:
            return 0.0
        unseen += not inside or grid.kind[i, j] == UNSEEN
    return unseen * away / steps


def narrow_passage(grid: FloorGrid, limits: BodyLimits, x: float, y: float, margin: float):
    """Crowding and ends of the roomiest straight way near a point, None for none."""
    ways = []
    for heading in np.arange(24) * math.pi / 24:
        along = np.array([math.cos(heading), math.sin(heading)])
        across = np.array([-along[1], along[0]])
        for aside in (-1.0, -0.5, 0.0, 0.5, 1.0):
            middle = np.array([x, y]) + aside * grid.voxel_size * across
            steps = 0.5 * grid.voxel_size * np.arange(1, int(1.8 / (0.5 * grid.voxel_size)) + 1)
            ends = [
                next(
                    (p for p in middle + np.outer(steps, way) if stands(grid, limits, p, margin)),
                    None,
                )
                for way in (-along, along)
            ]
            if any(end is None for end in ends):
                continue
            free, _, crowding = move_between(grid, limits, ends[0], ends[1], margin)
            if free:
                ways.append((crowding, ends))
    return None if not ways else min(ways, key=lambda way: way[0])


def stands(grid: FloorGrid, limits: BodyLimits, point: NDArray[np.float64], margin: float) -> bool:
    """See `can_stand`: room to turn, over floor whose middle was seen."""
    if clearance_at(grid, *point) < limits.radius + margin:
        return False
    site = grid.unseen[tuple(np.floor(point / grid.voxel_size).astype(int) - grid.origin)]
    seen_m = (
        math.inf if site[0] == BEYOND_CUTOFF else grid.voxel_size * math.hypot(*site.astype(float))
    )
    return seen_m >= (limits.unseen_half_width if len(limits.discs) else limits.unseen_radius)
