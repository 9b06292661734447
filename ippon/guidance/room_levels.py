"""Levels that depend on the room: a sink in a kitchen says less about a toilet than another."""

import copy
import dataclasses
import math
from collections import Counter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.frame import NANOSECONDS
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.levels import BY_OPERATOR, Guidance, LabelLevel, Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.guidance.rating import words
from ippon.guidance.rooms import NO_ROOM, RoomConfig, Rooms, columns_of, infer_rooms
from ippon.mapping.arrays import BLOCK_VOLUME, MapArrays
from ippon.mapping.objects.surface_rows import N_USED, NO_LABEL
from ippon.mapping.voxel_map import VoxelMap

_RINGS: Final = (0.4, 0.8)
"""Circles, as parts of a radius, on which rooms around a place are looked up."""
_SPOKES: Final = 12
_NAMED: Final = 4


class RoomLevels:
    """Rates the map's voxels by their label and the type of the room that they are in.

    Where the embedded prior rates a label higher in a room than in general, or takes back there
    that it is near, the room's rating takes the place of whatever level the guidance gives;
    elsewhere the guidance stands. A picture in a bedroom stays average for a toilet: it may hang
    beside the door of the bathroom. The operator's corrections are kept in every room. Without
    `RoomConfig.enabled` nothing is changed.
    """

    def __init__(self, config: RoomConfig) -> None:
        self._config = config
        self._prior = EmbeddedPrior()
        self._by_room: tuple[Guidance, ...] = ()
        self._table = np.zeros((0, 0), dtype=np.uint8)
        self._looked_ns: int | None = None
        self._levels = np.zeros((0, 512), dtype=np.uint8)
        self._revisions = np.zeros(0, dtype=np.int64)
        self.rooms: Rooms | None = None
        """As they were told apart last."""
        self.note = ""
        """In which types of room the goal is near, and in which far; empty without any."""

    def set_guidance(self, guidance: Guidance) -> None:
        """Rate the labels in every type of room."""
        if self._config.enabled:
            self._by_room = self._in_rooms(guidance)
            self._table = np.array([here.levels() for here in self._by_room])
            self.note = self._told(guidance)

    def around(self, xy: tuple[float, float], radius_m: float) -> tuple[tuple[str, Guidance], ...]:
        """Return the types of room near a place, the commonest first, and the guidance in each.

        Args:
            xy: World x and y, metres.
            radius_m: How far to look.
        """
        if self.rooms is None or not self._by_room:
            return ()
        turns = 2.0 * math.pi * np.arange(_SPOKES) / _SPOKES
        ring = np.stack([np.cos(turns), np.sin(turns)], axis=1) * radius_m
        at = np.array(xy) + np.concatenate([np.zeros((1, 2)), *(part * ring for part in _RINGS)])
        seen = Counter(n for n in self.rooms.at(at).tolist() if n != NO_ROOM)
        return tuple((words(self.rooms.types[n]), self._by_room[n]) for n, _ in seen.most_common())

    def room_at(self, xy: tuple[float, float]) -> tuple[str, Guidance] | None:
        """Return the type of the room at a place and the guidance in it; None where unclear."""
        if self.rooms is None or not self._by_room:
            return None
        room = int(self.rooms.at(np.array([xy]))[0])
        return None if room == NO_ROOM else (words(self.rooms.types[room]), self._by_room[room])

    def follow(self, voxel_map: VoxelMap, stamp_ns: int, floor_z_m: float) -> MapArrays:
        """Return the map with levels by label and room; the map itself stays as it is.

        A block in which a level changed by its room counts as changed, as if it had been observed.

        Args:
            voxel_map: The map.
            stamp_ns: The robot's clock: rooms are told apart anew every `RoomConfig.every_s`.
            floor_z_m: Height of the floor.
        """
        arrays = voxel_map.arrays()
        if not self._config.enabled:
            return arrays
        last = self._looked_ns
        if last is None or not 0 <= stamp_ns - last < self._config.every_s * NANOSECONDS:
            self._looked_ns = stamp_ns
            self.rooms = infer_rooms(voxel_map, self._config, floor_z_m)
        level = self._level(voxel_map, arrays)
        known = min(len(level), len(self._levels))
        moved = np.zeros(len(level), dtype=bool)
        moved[:known] = (level[:known] != self._levels[:known]).any(axis=1)
        revisions = np.zeros(len(arrays.revision), dtype=np.int64)
        known = min(len(revisions), len(self._revisions))
        revisions[:known] = self._revisions[:known]
        revisions[moved[arrays.slab]] = voxel_map.revision
        self._levels, self._revisions = level, revisions
        return arrays._replace(level=level, revision=np.maximum(arrays.revision, revisions))

    def supposing(self, guidance: Guidance) -> "RoomLevels":
        """Return the same rooms with the levels of another guidance."""
        other = copy.copy(self)
        other.set_guidance(guidance)
        return other

    def applied(self, voxel_map: VoxelMap, arrays: MapArrays) -> MapArrays:
        """Return a map, whose levels are those of this guidance by label, with levels by room."""
        return arrays._replace(level=self._level(voxel_map, arrays))

    def _in_rooms(self, guidance: Guidance) -> tuple[Guidance, ...]:
        """Return the guidance as it is in each type of room, in the order of `Rooms.types`."""
        labels = tuple(row.label for row in guidance.rows)
        goal = resolve_object(guidance.ooi, labels)
        general = self._prior.levels(goal, guidance.context, labels).rows
        out: list[Guidance] = []
        for room in self._prior.room_types:
            here = self._prior.levels(goal, guidance.context, labels, room=room).rows
            rows = (
                own if _counts(own, usual) and given.reason != BY_OPERATOR else given
                for own, usual, given in zip(here, general, guidance.rows, strict=True)
            )
            out.append(dataclasses.replace(guidance, rows=tuple(rows)))
        return tuple(out)

    def _told(self, guidance: Guidance) -> str:
        """Say what the types of room change, for people."""
        kinds: dict[Level, list[str]] = {Level.NEAR: [], Level.FAR: []}
        for room, here in zip(self._prior.room_types, self._by_room, strict=True):
            changed = Counter(
                own.level
                for own, usual in zip(here.rows, guidance.rows, strict=True)
                if own.level != usual.level
            )
            for level, _ in changed.most_common(1):
                if level in kinds:
                    kinds[level].append(f"the {words(room)}")
        parts = [
            f"{level.name.lower()} in {', '.join(names[:_NAMED])}"
            + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")
            for level, names in kinds.items()
            if names
        ]
        return f"things count by their room, too: {'; '.join(parts)}" if parts else ""

    def _level(self, voxel_map: VoxelMap, arrays: MapArrays) -> NDArray[np.uint8]:
        """Return (S, 512) levels by label and room, as `MapArrays.level`."""
        if self.rooms is None or self._table.shape[1] != len(voxel_map.labels):
            return arrays.level
        level, surface = arrays.level.copy(), voxel_map.surface
        used = slice(1, int(surface.tally[N_USED]))
        keep = (surface.voxel[used] >= 0) & (surface.label[used] != NO_LABEL)
        at = surface.voxel[used][keep]
        room = self.rooms.at(columns_of(voxel_map, at, arrays.voxel_size))
        known = room != NO_ROOM
        labels = surface.label[used][keep][known]
        slab = arrays.slab[at[known] // BLOCK_VOLUME].astype(np.int64)
        level.reshape(-1)[slab * BLOCK_VOLUME + at[known] % BLOCK_VOLUME] = self._table[
            room[known], labels
        ]
        return level


def _counts(own: LabelLevel, usual: LabelLevel) -> bool:
    """Tell whether a room's rating takes the place of the usual one; see `RoomLevels`."""
    return own.level > usual.level or (own.level < usual.level and usual.level > Level.AVERAGE)
