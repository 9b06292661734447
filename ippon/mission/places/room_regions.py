"""Rooms that were said, as regions of the map that are searched first or last."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ippon.frame import NANOSECONDS
from ippon.geometry import Float64Array
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.journal import Journal
from ippon.mission.operator_control import OperatorControl
from ippon.mission.search import Search
from ippon.mission.snapshot import Find
from ippon.planning.visibility.region_weights import WeightGrid
from ippon.rooms.named_rooms import RoomName
from ippon.rooms.room_inference import RoomConfig, Rooms, infer_rooms, room_evidence
from ippon.rooms.said_rooms import (
    RoomWeights,
    SaidRoom,
    SaidRoomConfig,
    is_elsewhere,
    read_said_rooms,
    weigh_rooms,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Said:
    """What was said of the rooms of one search."""

    search: Search
    rooms: tuple[SaidRoom, ...]


class RoomRegions:
    """Weighs the map's rooms by what was said of them, whenever a room is recognised or named.

    Args:
        config: Weights, and how often the rooms are inferred.
        voxel_map: The map.
        operator: Takes the weights.
        journal: Takes what the operator should know.
    """

    def __init__(
        self,
        config: SaidRoomConfig,
        voxel_map: VoxelMap,
        operator: OperatorControl,
        journal: Journal,
    ) -> None:
        self._config = config
        self._voxel_map = voxel_map
        self._operator = operator
        self._journal = journal
        self._names: tuple[RoomName, ...] = ()
        self._said: tuple[_Said, ...] = ()
        self._searches: tuple[Search, ...] = ()
        self._inferred_ns: int | None = None
        self._rooms: Rooms | None = None
        self._weights: dict[int, RoomWeights] = {}
        self._grid: WeightGrid | None = None
        """What the operator's control has, None for none."""
        self.text = ""
        """How the rooms that were said are used, for the operator; empty where none was said."""

    def set_names(self, names: Sequence[RoomName]) -> None:
        """Set the names that people have given to rooms; they apply from the next step."""
        self._names = tuple(names)
        self._searches, self._inferred_ns = (), None

    def step(self, searches: Sequence[Search], stamp_ns: int, floor_z_m: float) -> None:
        """Weigh the rooms for the searches that run, if it is time.

        Args:
            searches: The searches.
            stamp_ns: Robot time.
            floor_z_m: Height of the floor, world frame, metres.
        """
        running = tuple(search for search in searches if not search.over)
        if running != self._searches:
            self._read(running)
        if not self._said:
            self._clear()
            return
        since_ns = None if self._inferred_ns is None else stamp_ns - self._inferred_ns
        if since_ns is not None and 0 <= since_ns < self._config.every_s * NANOSECONDS:
            return
        self._inferred_ns = stamp_ns
        evidence = room_evidence(self._voxel_map, RoomConfig(), floor_z_m)
        self._rooms = infer_rooms(evidence, RoomConfig())
        self._weigh(self._rooms)

    def is_elsewhere(self, search: Search, find: Find) -> bool:
        """Return whether a find is surely in none of the rooms that were said of its search."""
        weights = self._weights.get(search.goal.goal_id)
        said = next((one.rooms for one in self._said if one.search is search), ())
        if weights is None or self._rooms is None:
            return False
        part = int(self._rooms.parts_at(np.array([find.position_world[:2]]))[0])
        return is_elsewhere(said, weights.by_part, part)

    def _read(self, running: tuple[Search, ...]) -> None:
        """Read what is said of the rooms of each search."""
        self._searches, self._inferred_ns = running, None
        names = [one.name for one in self._names]
        read = (
            _Said(
                search=one,
                rooms=read_said_rooms(one.goal.context, names, ooi=one.goal.object),
            )
            for one in running
        )
        self._said = tuple(read)
        if not any(one.rooms for one in self._said):
            self._said = ()

    def _weigh(self, rooms: Rooms) -> None:
        weights = [weigh_rooms(one.rooms, rooms, self._names, self._config) for one in self._said]
        self._weights = {
            one.search.goal.goal_id: weighed
            for one, weighed in zip(self._said, weights, strict=True)
        }
        # A tour's plan is over all goals that are missing: a room counts as for the one of them
        # that it counts most for.
        by_part = np.maximum.reduce([one.by_part for one in weights])
        grid = _grid(rooms, by_part)
        before = self._grid
        changes = bool((by_part != 1.0).any()) if before is None else not grid.is_same(before)
        if changes:
            self._grid = grid
            self._operator.set_rooms(grid)
        text = "; ".join(dict.fromkeys(filter(None, (one.text for one in weights))))
        if text != self.text:
            self.text = text
            self._journal.note("guidance", text)

    def _clear(self) -> None:
        self.text, self._weights, self._rooms = "", {}, None
        if self._grid is not None:
            self._grid = None
            self._operator.set_rooms(None)


def _grid(rooms: Rooms, by_part: Float64Array) -> WeightGrid:
    return WeightGrid(cell_m=rooms.cell_m, origin=rooms.origin, weights=by_part[rooms.part])
