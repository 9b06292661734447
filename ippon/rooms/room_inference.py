"""Which type of room is where, from what was seen so far: geometry parts, common objects name.

Space that is open above the furniture is cut at its doors, and every part is the likeliest type of
room given the kinds of common objects in it, each kind taken by itself: a toilet speaks for a
bathroom, a sink for kitchen and bathroom alike, a wall for nothing. A part that could be two types,
or holds too little that tells, has none.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.segmentation import watershed

from ippon.geometry import Float64Array
from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.rating import words
from ippon.mapping.arrays import FREE
from ippon.mapping.blocks import N_ROWS
from ippon.mapping.objects.surface_rows import N_USED, NO_LABEL
from ippon.mapping.voxel_map import VoxelMap

NO_ROOM: Final = -1
_CELL_VOXELS: Final = 2
_ENOUGH_VOXELS: Final = 200
"""Voxels of a label from which it counts as seen; fewer, often misread, count in proportion."""
_ODD_SHARE: Final = 0.03
"""Share of a thing that may be in a type of room where the table has none of it."""
_MIN_CONFIDENCE: Final = 127


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomConfig:
    """How rooms are told apart."""

    open_height_m: float = 1.5
    """Height at which open space makes the shape of a room: above furniture, below lintels."""
    door_width_m: float = 1.05
    """Openings up to this width part two rooms; more keeps wide passages apart, too, and cuts
    rooms where a tall cupboard narrows them."""
    reach_m: float = 0.7
    """Things this far from open space belong to it; more takes things in deep furniture along."""
    min_share: float = 0.75
    """Probability from which a room has its type; more leaves more rooms without one."""
    min_kinds: float = 1.0
    """Kinds of telling objects from which it has one; half a one is a kind that is half seen."""

    def __post_init__(self) -> None:
        """Reject shares and lengths that cannot be."""
        if not 0.5 <= self.min_share <= 1.0:
            raise ValueError(f"min_share must lie in [0.5, 1]; got {self.min_share}")
        for name in ("open_height_m", "door_width_m", "reach_m", "min_kinds"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive; got {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Rooms:
    """Types of room over the plane, as far as they are clear."""

    types: tuple[str, ...]
    cell_m: float
    origin: NDArray[np.int64]
    """(2,) cell index of `part[0, 0]`."""
    part: NDArray[np.int32]
    """(X, Y) number of the part that a cell belongs to, 0 for none."""
    room: NDArray[np.int64]
    """(P + 1,) index into `types` of each part, `NO_ROOM` where it is not clear."""
    share: Float64Array
    """(P + 1,) probability of the likeliest type."""

    def at(self, xy: Float64Array) -> NDArray[np.int64]:
        """Return (M,) index into `types` for (M, 2) world positions, `NO_ROOM` where unclear."""
        cell = np.floor(xy / self.cell_m).astype(np.int64) - self.origin
        inside = ((cell >= 0) & (cell < self.part.shape)).all(axis=1)
        out = np.full(len(xy), NO_ROOM, dtype=np.int64)
        out[inside] = self.room[self.part[cell[inside, 0], cell[inside, 1]]]
        return out

    def name_at(self, xy: tuple[float, float]) -> str:
        """Return the type of room at a world position, in words; empty where it is not clear."""
        room = int(self.at(np.array([xy]))[0])
        return "" if room == NO_ROOM else words(self.types[room])


def room_shares(labels: Sequence[str]) -> tuple[tuple[str, ...], Float64Array]:
    """Return the types of room, and in which of them things of each label are found.

    Returns:
        The types, and (N, R) float64: shares of the table; a row of zeros for a label that is found
        in every room, stands for many things, or is unknown.
    """
    knowledge = load_knowledge()
    types = knowledge.room_types
    shares = np.zeros((len(labels), len(types)))
    for n, label in enumerate(labels):
        entry = knowledge.find(words(label))
        if entry is None or entry.thing.spread != "none":
            continue
        for room, share in entry.thing.rooms.items():
            shares[n, types.index(room)] = share
    return types, shares


def rate_types(seen: Float64Array, shares: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Weigh the types of room by what was seen in each part.

    Args:
        seen: (P, N) voxels of each label in each part.
        shares: (N, R) as of `room_shares`.

    Returns:
        (P, R) probabilities of the types, all equally likely beforehand, and (P,) how many kinds of
        telling objects they rest on.
    """
    telling = shares.sum(axis=1) > 0.0
    weight = np.minimum(seen / _ENOUGH_VOXELS, 1.0) * telling
    evidence = weight @ np.log(np.where(telling[:, None], shares + _ODD_SHARE, 1.0))
    odds = np.exp(evidence - evidence.max(axis=1, keepdims=True))
    return odds / odds.sum(axis=1, keepdims=True), weight.sum(axis=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomEvidence:
    """Copy of what rooms are inferred from, so that any thread may infer them."""

    labels: tuple[str, ...]
    cell_m: float
    origin: NDArray[np.int64]
    """(2,) index of the first cell."""
    is_open: NDArray[np.bool_]
    """(X, Y) cells that are open at `RoomConfig.open_height_m`."""
    positions_xy: Float64Array
    """(M, 2) world positions of labelled surface, metres."""
    label: NDArray[np.int64]
    """(M,) index into `labels`."""


def room_evidence(voxel_map: VoxelMap, config: RoomConfig, floor_z_m: float = 0.0) -> RoomEvidence:
    """Return a copy of the map's evidence for rooms.

    Args:
        voxel_map: The map so far.
        config: Height of open space.
        floor_z_m: Height of the floor.
    """
    voxel_m = voxel_map.config.voxel_size_m
    layer = int(np.floor((floor_z_m + config.open_height_m) / voxel_m))
    origin, is_open = _open_cells(voxel_map, layer)
    xy, label = _labelled(voxel_map, voxel_m)
    return RoomEvidence(
        labels=tuple(voxel_map.labels),
        cell_m=_CELL_VOXELS * voxel_m,
        origin=origin,
        is_open=is_open,
        positions_xy=xy,
        label=label,
    )


def infer_rooms(evidence: RoomEvidence, config: RoomConfig) -> Rooms:
    """Infer the rooms and their types.

    Args:
        evidence: Open cells and labelled surface.
        config: How to tell rooms apart.
    """
    types, shares = room_shares(evidence.labels)
    origin, cell_m = evidence.origin, evidence.cell_m
    part = _parts(evidence.is_open, cell_m, config)
    cell = np.floor(evidence.positions_xy / cell_m).astype(np.int64) - origin
    inside = ((cell >= 0) & (cell < part.shape)).all(axis=1)
    seen = np.zeros((int(part.max(initial=0)) + 1, len(evidence.labels)))
    np.add.at(seen, (part[cell[inside, 0], cell[inside, 1]], evidence.label[inside]), 1.0)
    seen[0] = 0.0
    probability, kinds = rate_types(seen, shares)
    share = probability.max(axis=1)
    clear = (share >= config.min_share) & (kinds >= config.min_kinds)
    room = np.where(clear, probability.argmax(axis=1), NO_ROOM)
    return Rooms(types=types, cell_m=cell_m, origin=origin, part=part, room=room, share=share)


def _open_cells(voxel_map: VoxelMap, layer: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the first cell, and (X, Y) cells that are open in all their voxels of a layer."""
    pools = voxel_map.pools
    n = int(pools.tally[N_ROWS])
    rows = np.flatnonzero((pools.used[:n] == 1) & (pools.coord[:n, 2] == layer >> 3))
    if not len(rows):
        return np.zeros(2, dtype=np.int64), np.zeros((0, 0), dtype=np.bool_)
    coord = pools.coord[rows, :2]
    low = coord.min(axis=0)
    size = (coord.max(axis=0) - low + 1) * 8
    grid = np.zeros(tuple(size), dtype=np.bool_)
    state = pools.state[rows].reshape(-1, 8, 8, 8)[..., layer & 7] == FREE
    for (x, y), block in zip(((coord - low) * 8).tolist(), state, strict=True):
        grid[x : x + 8, y : y + 8] = block
    cells = grid.reshape(size[0] // _CELL_VOXELS, _CELL_VOXELS, size[1] // _CELL_VOXELS, -1)
    return low * 8 // _CELL_VOXELS, np.asarray(cells.all(axis=(1, 3)))


def _parts(is_open: NDArray[np.bool_], cell_m: float, config: RoomConfig) -> NDArray[np.int32]:
    """Cut open space at its doors; what is close to a part belongs to it."""
    if not is_open.any():
        return np.zeros(is_open.shape, dtype=np.int32)
    # To the edge of the nearest cell that is closed, not to its centre.
    to_closed = np.asarray(ndimage.distance_transform_edt(np.pad(is_open, 1)))[1:-1, 1:-1]
    distance_m = cell_m * (to_closed - 0.5)
    cores, _ = ndimage.label(distance_m > 0.5 * config.door_width_m)  # pyright: ignore[reportGeneralTypeIssues]
    near = np.asarray(ndimage.distance_transform_edt(~is_open)) * cell_m <= config.reach_m
    # Flooded from the open space outwards, so that things go to the side of a wall that they face.
    depth = np.where(is_open, -distance_m, 10.0)
    return np.asarray(watershed(depth, cores, mask=near), dtype=np.int32)


def _labelled(voxel_map: VoxelMap, voxel_m: float) -> tuple[Float64Array, NDArray[np.int64]]:
    """Return (M, 2) positions and (M,) labels of the surface that is told apart well enough."""
    surface = voxel_map.surface
    used = slice(1, int(surface.tally[N_USED]))
    keep = (
        (surface.voxel[used] >= 0)
        & (surface.label[used] != NO_LABEL)
        & (surface.confidence[used] >= _MIN_CONFIDENCE)
    )
    at = surface.voxel[used][keep]
    return columns_of(voxel_map, at, voxel_m), surface.label[used][keep].astype(np.int64)


def columns_of(voxel_map: VoxelMap, at: NDArray[np.int32], voxel_m: float) -> Float64Array:
    """Return (M, 2) world x and y of the centres of voxels, given as `SurfaceRows.voxel`."""
    row, k = at // 512, at % 512
    offset = np.stack([k >> 6, (k >> 3) & 7], axis=1)
    index = voxel_map.pools.coord[row, :2] * 8 + offset
    return (index.astype(np.float64) + 0.5) * voxel_m
