"""Inference of room types from the map.

Space that is open above the furniture is divided at doors. The type of each part is the most
probable one given the kinds of common objects in it, taken as independent: a toilet indicates a
bathroom, a sink kitchen or bathroom, a wall nothing. A part with several plausible types, or too
few informative objects, has no type.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.segmentation import watershed

from ippon.frame import UNDERFOOT_M
from ippon.geometry import Float64Array
from ippon.guidance.knowledge import WITHIN_REACH_M, load_knowledge
from ippon.mapping.arrays import FREE
from ippon.mapping.objects.surface_voxels import N_USED, NO_LABEL
from ippon.mapping.voxel_map import VoxelMap
from ippon.vocabulary import in_words

NO_ROOM: Final = -1
_CELL_VOXELS: Final = 2
_REFERENCE_CELL_M: Final = 0.2
"""Edge of a cell of the voxels that `RoomConfig.enough_voxels` counts, metres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomConfig:
    """Parameters of room inference."""

    open_height_m: float = 1.5
    """Height at which open space defines the rooms: above furniture, below lintels."""
    door_width_m: float = 1.05
    """Widest opening that separates two rooms; more also separates wide passages, and divides rooms
    where a tall cupboard narrows them."""
    reach_m: float = 0.7
    """Distance to open space within which objects count; more includes objects in deep
    furniture."""
    enough_voxels: int = 200
    """Voxels of a label from which it counts fully, where a voxel has 0.1 m; others count by the
    surface that they cover. Fewer count in proportion, as they are often misread. More requires
    larger views of objects."""
    odd_share: float = 0.03
    """Probability of a label in a room type for which the table lists none; more tolerates more
    misplaced objects."""
    min_confidence: float = 0.5
    """Least probability of a voxel's label; more uses fewer voxels."""
    min_share: float = 0.75
    """Least probability of a room's type; more leaves more rooms without one."""
    min_kinds: float = 1.0
    """Least number of informative kinds of objects; a partly visible kind counts in proportion."""

    def __post_init__(self) -> None:
        """Reject values out of range."""
        if not 0.5 <= self.min_share <= 1.0:
            raise ValueError(f"min_share must lie in [0.5, 1]; got {self.min_share}")
        for name in (
            "open_height_m",
            "door_width_m",
            "reach_m",
            "enough_voxels",
            "odd_share",
            "min_kinds",
        ):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive; got {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Rooms:
    """Room types over the plane."""

    types: tuple[str, ...]
    cell_m: float
    origin: NDArray[np.int64]
    """(2,) cell index of `part[0, 0]`."""
    part: NDArray[np.int32]
    """(X, Y) number of the part of each cell, 0 for none."""
    room: NDArray[np.int64]
    """(P + 1,) index into `types` of each part, `NO_ROOM` if unclear."""
    probability: Float64Array
    """(P + 1, R) probability of each type."""
    floor_z_m: float = 0.0
    """Height of the floor that the rooms are on, world frame."""

    def at(self, xy: Float64Array) -> NDArray[np.int64]:
        """Return (M,) index into `types` for (M, 2) world positions, `NO_ROOM` if unclear."""
        part = self.parts_at(xy)
        return np.where(part < 0, NO_ROOM, self.room[np.maximum(part, 0)])

    def parts_at(self, xy: Float64Array) -> NDArray[np.int64]:
        """Return (M,) number of the part at (M, 2) world positions, -1 outside the cells."""
        cell = np.floor(xy / self.cell_m).astype(np.int64) - self.origin
        inside = ((cell >= 0) & (cell < self.part.shape)).all(axis=1)
        out = np.full(len(xy), -1, dtype=np.int64)
        out[inside] = self.part[cell[inside, 0], cell[inside, 1]]
        return out

    def name_at(self, xy: tuple[float, float]) -> str:
        """Return the room type at a world position, in words; empty if unclear."""
        room = int(self.at(np.array([xy]))[0])
        return "" if room == NO_ROOM else in_words(self.types[room])


def room_shares(labels: Sequence[str]) -> tuple[tuple[str, ...], Float64Array]:
    """Return the room types, and the shares of each label over them.

    Returns:
        The types, and (N, R) float64 shares from the table; zeros for a label that occurs in every
        room, stands for many kinds of objects, or is unknown.
    """
    knowledge = load_knowledge()
    types = knowledge.room_types
    shares = np.zeros((len(labels), len(types)))
    for n, label in enumerate(labels):
        entry = knowledge.find(in_words(label))
        if entry is None or entry.thing.spread != "none":
            continue
        for room, share in entry.thing.rooms.items():
            shares[n, types.index(room)] = share
    return types, shares


def rate_types(
    seen: Float64Array, shares: Float64Array, config: RoomConfig
) -> tuple[Float64Array, Float64Array]:
    """Return the probabilities of the room types of each part.

    Args:
        seen: (P, N) voxels of each label in each part, in voxels of 0.1 m.
        shares: (N, R) from `room_shares`.
        config: Parameters.

    Returns:
        (P, R) probabilities with a uniform prior, and (P,) the number of informative kinds.
    """
    telling = shares.sum(axis=1) > 0.0
    weight = np.minimum(seen / config.enough_voxels, 1.0) * telling
    evidence = weight @ np.log(np.where(telling[:, None], shares + config.odd_share, 1.0))
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
    floor_z_m: float
    """Height of the floor, world frame."""


def room_evidence(voxel_map: VoxelMap, config: RoomConfig, floor_z_m: float = 0.0) -> RoomEvidence:
    """Return a copy of the map's evidence for rooms.

    Args:
        voxel_map: The map so far.
        config: Parameters.
        floor_z_m: Height of the floor; surface of other floors does not count.
    """
    voxel_m = voxel_map.config.voxel_size_m
    layer = int(np.floor((floor_z_m + config.open_height_m) / voxel_m))
    origin, is_open = _open_cells(voxel_map, layer)
    xy, label = _labelled(voxel_map, voxel_m, config.min_confidence, floor_z_m)
    return RoomEvidence(
        labels=tuple(voxel_map.labels),
        cell_m=_CELL_VOXELS * voxel_m,
        origin=origin,
        is_open=is_open,
        positions_xy=xy,
        label=label,
        floor_z_m=floor_z_m,
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
    seen *= (cell_m / _REFERENCE_CELL_M) ** 2
    probability, kinds = rate_types(seen, shares, config)
    share = probability.max(axis=1)
    clear = (share >= config.min_share) & (kinds >= config.min_kinds)
    room = np.where(clear, probability.argmax(axis=1), NO_ROOM)
    return Rooms(
        types=types,
        cell_m=cell_m,
        origin=origin,
        part=part,
        room=room,
        probability=probability,
        floor_z_m=evidence.floor_z_m,
    )


def _open_cells(voxel_map: VoxelMap, layer: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the first cell, and (X, Y) cells whose voxels of a layer are all free."""
    arrays = voxel_map.arrays()
    z = (layer >> 3) - int(arrays.origin_block[2])
    if not 0 <= z < arrays.directory.shape[2] or not (arrays.directory[:, :, z] >= 0).any():
        return np.zeros(2, dtype=np.int64), np.zeros((0, 0), dtype=np.bool_)
    at = np.argwhere(arrays.directory[:, :, z] >= 0)
    rows, coord = arrays.directory[at[:, 0], at[:, 1], z], arrays.origin_block[:2] + at
    low = coord.min(axis=0)
    size = (coord.max(axis=0) - low + 1) * 8
    grid = np.zeros(tuple(size), dtype=np.bool_)
    state = arrays.state[rows].reshape(-1, 8, 8, 8)[..., layer & 7] == FREE
    for (x, y), block in zip(((coord - low) * 8).tolist(), state, strict=True):
        grid[x : x + 8, y : y + 8] = block
    cells = grid.reshape(size[0] // _CELL_VOXELS, _CELL_VOXELS, size[1] // _CELL_VOXELS, -1)
    return low * 8 // _CELL_VOXELS, np.asarray(cells.all(axis=(1, 3)))


def _parts(is_open: NDArray[np.bool_], cell_m: float, config: RoomConfig) -> NDArray[np.int32]:
    """Divide open space at doors; cells near a part are added to it."""
    if not is_open.any():
        return np.zeros(is_open.shape, dtype=np.int32)
    # To the edge of the nearest closed cell, not to its centre.
    to_closed = np.asarray(ndimage.distance_transform_edt(np.pad(is_open, 1)))[1:-1, 1:-1]
    distance_m = cell_m * (to_closed - 0.5)
    cores, _ = ndimage.label(distance_m > 0.5 * config.door_width_m)  # pyright: ignore[reportGeneralTypeIssues]
    near = np.asarray(ndimage.distance_transform_edt(~is_open)) * cell_m <= config.reach_m
    # Flooded outwards, so that surface belongs to the side of a wall that it faces.
    depth = np.where(is_open, -distance_m, 10.0)
    return np.asarray(watershed(depth, cores, mask=near), dtype=np.int32)


def _labelled(
    voxel_map: VoxelMap, voxel_m: float, min_confidence: float, floor_z_m: float
) -> tuple[Float64Array, NDArray[np.int64]]:
    """Return (M, 2) positions and (M,) labels of a floor's surface with a confident label."""
    surface = voxel_map.surface
    used = slice(1, int(surface.tally[N_USED]))
    keep = (
        (surface.voxel[used] >= 0)
        & (surface.label[used] != NO_LABEL)
        & (surface.confidence[used] >= 254.0 * min_confidence)
    )
    centres = _centres(voxel_map, surface.voxel[used][keep], voxel_m)
    height_m = centres[:, 2] - floor_z_m
    here = (height_m > -UNDERFOOT_M) & (height_m < WITHIN_REACH_M)
    return centres[here, :2], surface.label[used][keep][here].astype(np.int64)


def _centres(voxel_map: VoxelMap, at: NDArray[np.int32], voxel_m: float) -> Float64Array:
    """Return (M, 3) centres of voxels, given as `SurfaceVoxels.voxel`, metres."""
    row, k = at // 512, at % 512
    offset = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
    index = voxel_map.block_coords[row] * 8 + offset
    return (index.astype(np.float64) + 0.5) * voxel_m
