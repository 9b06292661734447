"""Levels that depend on the room: a sink in a kitchen says less about a toilet than another."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.guidance.levels import BY_OPERATOR, Guidance
from ippon.guidance.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.guidance.rooms import NO_ROOM, RoomConfig, Rooms, columns_of, infer_rooms
from ippon.mapping.arrays import BLOCK_VOLUME, MapArrays
from ippon.mapping.surface_rows import N_USED, NO_LABEL
from ippon.mapping.voxel_map import VoxelMap

_NANOSECONDS: Final = 1_000_000_000


class RoomLevels:
    """Rates the map's voxels by their label and the type of the room that they are in.

    Where the embedded prior rates a label otherwise in a room than in general, the room's rating
    takes the place of whatever level the guidance gives; elsewhere the guidance stands. The
    operator's corrections are kept in every room.
    """

    def __init__(self, config: RoomConfig) -> None:
        self._config = config
        self._prior = EmbeddedPrior()
        self._table = np.zeros((0, 0), dtype=np.uint8)
        self._looked_ns: int | None = None
        self._levels = np.zeros((0, 512), dtype=np.uint8)
        self._revisions = np.zeros(0, dtype=np.int64)
        self.rooms: Rooms | None = None
        """As they were told apart last."""

    def set_guidance(self, guidance: Guidance) -> None:
        """Rate the labels in every type of room."""
        self._table = self._by_room(guidance)

    def follow(self, voxel_map: VoxelMap, stamp_ns: int, floor_z_m: float) -> MapArrays:
        """Return the map with levels by label and room; the map itself stays as it is.

        A block in which a level changed by its room counts as changed, as if it had been observed.

        Args:
            voxel_map: The map.
            stamp_ns: The robot's clock: rooms are told apart anew every `RoomConfig.every_s`.
            floor_z_m: Height of the floor.
        """
        last = self._looked_ns
        if last is None or not 0 <= stamp_ns - last < self._config.every_s * _NANOSECONDS:
            self._looked_ns = stamp_ns
            self.rooms = infer_rooms(voxel_map, self._config, floor_z_m)
        assert self.rooms is not None, "set above"
        arrays = voxel_map.arrays()
        level = self._level(voxel_map, arrays, self.rooms)
        known = min(len(level), len(self._levels))
        moved = np.zeros(len(level), dtype=bool)
        moved[:known] = (level[:known] != self._levels[:known]).any(axis=1)
        revisions = np.zeros(len(arrays.revision), dtype=np.int64)
        known = min(len(revisions), len(self._revisions))
        revisions[:known] = self._revisions[:known]
        revisions[moved[arrays.slab]] = voxel_map.revision
        self._levels, self._revisions = level, revisions
        return arrays._replace(level=level, revision=np.maximum(arrays.revision, revisions))

    def _level(self, voxel_map: VoxelMap, arrays: MapArrays, rooms: Rooms) -> NDArray[np.uint8]:
        """Return (S, 512) levels by label and room, as `MapArrays.level`."""
        level, surface = arrays.level.copy(), voxel_map.surface
        used = slice(1, int(surface.tally[N_USED]))
        keep = (surface.voxel[used] >= 0) & (surface.label[used] != NO_LABEL)
        at = surface.voxel[used][keep]
        room = rooms.at(columns_of(voxel_map, at, arrays.voxel_size))
        known = room != NO_ROOM
        if known.any() and self._table.shape[1] == len(voxel_map.labels):
            labels = surface.label[used][keep][known]
            slab = arrays.slab[at[known] // BLOCK_VOLUME].astype(np.int64)
            level.reshape(-1)[slab * BLOCK_VOLUME + at[known] % BLOCK_VOLUME] = self._table[
                room[known], labels
            ]
        return level

    def _by_room(self, guidance: Guidance) -> NDArray[np.uint8]:
        """Return (R, N) levels of every label in every type of room."""
        labels = tuple(row.label for row in guidance.rows)
        goal = resolve_object(guidance.ooi, labels)
        general = self._prior.levels(goal, guidance.context, labels).levels()
        given = guidance.levels()
        edited = np.array([row.reason == BY_OPERATOR for row in guidance.rows])
        table = []
        for room in self._prior.room_types:
            here = self._prior.levels(goal, guidance.context, labels, room=room).levels()
            table.append(np.where((here != general) & ~edited, here, given))
        return np.array(table, dtype=np.uint8)
