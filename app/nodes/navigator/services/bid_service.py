"""Bids of the robot: would it take a search, does it know the place, and how far is it?"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.messages.control import Bid, BidRequest, Ground, SearchRequest
from app.messages.lease import Credential
from app.messages.status import MissionState
from app.nodes.navigator.services.goal_service import GoalService
from app.nodes.navigator.services.lease_service import LeaseService
from app.nodes.navigator.services.operation_queue import OperationQueue
from ippon.geometry import Float64Array
from ippon.memory.instance import Instance
from ippon.memory.lookup import find_instances
from ippon.mission.mission import Mission
from ippon.planning.floor_ways import FloorSurvey, FloorWays, ReachedFloor
from ippon.rooms.named_rooms import RoomName
from ippon.rooms.room_inference import (
    RoomConfig,
    RoomEvidence,
    infer_rooms,
    room_evidence,
)
from ippon.rooms.said_rooms import SaidRoom, read_said_rooms, said_parts
from ippon.vocabulary import in_words

LEAST_PROBABILITY: Final = 0.5
"""That a remembered thing is the object, from which its place counts as known."""
BESIDE_M: Final = 1.0
"""Distance between a thing and the end of a way to it."""
EXPLORED_M2: Final = 1.0
"""Explored floor from which a robot has a map."""
_TEXT: Final = 300


@dataclass(frozen=True, slots=True, kw_only=True)
class _Seen:
    """What the mission's thread has copied."""

    state: MissionState
    labels: tuple[str, ...]
    floor: ReachedFloor | None
    """None before the first frame."""
    rooms: RoomEvidence | None
    """None where no room was said."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    ground: Ground
    name: str = ""
    room: str = ""
    way_m: float | None = None


class BidService:
    """Answers every requester; the mission's thread only copies, and nothing changes."""

    def __init__(
        self,
        survey: FloorSurvey,
        operations: OperationQueue,
        goals: GoalService,
        control: LeaseService,
    ) -> None:
        self._survey = survey
        self._operations = operations
        self._goals, self._control = goals, control
        self.room_names: Callable[[], tuple[RoomName, ...]] = tuple
        """Returns the names that people have given to rooms; the navigator sets it."""

    def bid(self, request: BidRequest, who: Credential | None) -> Bid:
        """Return whether a search could start at once, and how far its place is.

        Raises:
            RequestRefusedError: It is no search, or the mission's thread did not answer.
        """
        self._goals.plan(request.search)
        search, named = self._goals.checked(request.search)
        names = self.room_names()
        said = tuple(
            one
            for one in read_said_rooms(search.context, [name.name for name in names])
            if not one.negated
        )
        seen = self._operations.ask(lambda mission: self._look(mission, rooms=bool(said)))
        obstacle, detail = self._goals.availability.obstacle(seen.state)
        holder = self._control.holder_besides(who)
        if holder:
            obstacle, detail = "held", holder
        status = self._goals.availability.status
        explored_m2 = 0.0 if status is None else status.explored_m2
        place = self._place(search, named, said, names, seen, explored_m2)
        return Bid(
            obstacle=obstacle,
            detail=detail[:_TEXT],
            ground=place.ground,
            place=place.name[:_TEXT],
            room=place.room[:_TEXT],
            way_m=None if place.way_m is None else round(place.way_m, 2),
            explored_m2=round(explored_m2, 1),
        )

    def _look(self, mission: Mission, *, rooms: bool) -> _Seen:
        """Copy what the bid needs; runs in the mission's thread."""
        frame, voxel_map = mission.operator.frame, mission.voxel_map
        floor = None
        if frame is not None:
            floor = self._survey.read(voxel_map.arrays(), frame.T_world_base)
        evidence = None
        if rooms:
            evidence = room_evidence(voxel_map, RoomConfig(), mission.floor_z_m)
        return _Seen(
            state=mission.state.value, labels=tuple(voxel_map.labels), floor=floor, rooms=evidence
        )

    def _place(
        self,
        search: SearchRequest,
        named: Instance | None,
        said: tuple[SaidRoom, ...],
        names: tuple[RoomName, ...],
        seen: _Seen,
        explored_m2: float,
    ) -> _Place:
        ways = None if seen.floor is None else seen.floor.ways()
        if seen.rooms is not None:
            return _said_room(said, seen.rooms, names, ways)
        things = [named] if named is not None else self._remembered(search.object, seen.labels)
        known = [_thing(one, ways) for one in things if not one.is_gone]
        if known:
            return min(known, key=lambda one: np.inf if one.way_m is None else one.way_m)
        if explored_m2 >= EXPLORED_M2:
            return _Place(ground="area", way_m=None if ways is None else 0.0)
        return _Place(ground="unknown")

    def _remembered(self, wanted: str, labels: tuple[str, ...]) -> list[Instance]:
        try:
            matches = find_instances(self._goals.things(), wanted, labels)
        except ValueError:
            # Not a word, such as "???": nothing has that name.
            return []
        return [one.instance for one in matches if one.probability >= LEAST_PROBABILITY]


def _said_room(
    said: tuple[SaidRoom, ...],
    evidence: RoomEvidence,
    names: tuple[RoomName, ...],
    ways: FloorWays | None,
) -> _Place:
    """Return the nearest of the rooms that were said."""
    rooms = infer_rooms(evidence, RoomConfig())
    found: list[_Place] = []
    for part, name in said_parts(said, rooms, names).items():
        cells = np.argwhere(rooms.part == part)
        centres: Float64Array = (cells + rooms.origin + 0.5).astype(np.float64) * rooms.cell_m
        way_m = None if ways is None else ways.to_any(centres)
        found.append(_Place(ground="room", name=name, way_m=way_m))
    if not found:
        return _Place(ground="unknown", name=" or ".join(one.place for one in said))
    return min(found, key=lambda one: np.inf if one.way_m is None else one.way_m)


def _thing(one: Instance, ways: FloorWays | None) -> _Place:
    way_m = None
    if ways is not None:
        half = 0.5 * float(np.hypot(*one.size_m[:2]))
        point: Float64Array = np.array([one.position_world[:2]])
        way_m = ways.to_any(point, within_m=half + BESIDE_M)
    name = one.name or in_words(one.believed or one.label)
    return _Place(ground="thing", name=name, room=one.room, way_m=way_m)
