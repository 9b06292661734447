"""Requests about rooms: where they are, what they are, and what people call them."""

import threading
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from app.errors import MemoryFileError
from app.links.network.requests import RequestRefusedError
from app.memory.room_names import MAX_ROOMS, checked_name, read_room_names, write_room_names
from app.messages.memory import Room, RoomNameRequest, RoomsReply, RoomsRequest
from app.nodes.navigator.services.operation_queue import OperationQueue
from ippon.atomic_file import set_aside
from ippon.rooms.named_rooms import RoomName, name_lookup, renamed, room_places
from ippon.rooms.room_inference import RoomConfig, Rooms, infer_rooms, room_evidence

TIMEOUT_S: Final = 5.0


class RoomService:
    """Infers the rooms when it is asked; names are kept in a file beside the map."""

    def __init__(
        self,
        operations: OperationQueue,
        report_event: Callable[[str, str], None],
        path: Path | None = None,
        *,
        map_was_read: bool = False,
    ) -> None:
        """Read the names of an earlier run.

        Args:
            operations: Gives access to the map.
            report_event: Reports what the operator should know.
            path: File of the names; None keeps them only while the process runs.
            map_was_read: The map was read from its file, so that kept names fit it.
        """
        self._operations = operations
        self._path = path
        self._lock = threading.Lock()
        self.names: tuple[RoomName, ...] = ()
        """All names, for any thread."""
        self.problem = ""
        """Why names are not kept."""
        if path is not None and path.exists():
            self._read(path, report_event, map_was_read=map_was_read)

    def rooms(self, _: RoomsRequest) -> RoomsReply:
        """Return the rooms of the map as it is now."""
        return self._reply(self._infer())

    def rename(self, request: RoomNameRequest) -> RoomsReply:
        """Name the room at a point, and keep the name."""
        rooms = self._infer()
        with self._lock:
            try:
                name = checked_name(request.name)
                names = renamed(rooms, self.names, request.x_m, request.y_m, name)
            except ValueError as error:
                raise RequestRefusedError(str(error)) from error
            if len(names) > MAX_ROOMS:
                raise RequestRefusedError(f"{MAX_ROOMS} rooms have names; remove one first")
            if self._path is not None:
                try:
                    write_room_names(self._path, names)
                except MemoryFileError as error:
                    raise RequestRefusedError(str(error)) from error
            self.names = names
            self._operations.enqueue(lambda mission: mission.rooms.set_names(names))
        return self._reply(rooms)

    def room_of(self, points: Sequence[tuple[float, float]]) -> str:
        """Return the name or type of the room that holds most of some points; empty for none.

        Raises:
            RequestRefusedError: The map did not answer in time.
        """
        name_at = name_lookup(self._infer(), self.names)
        found = Counter(filter(None, map(name_at, points)))
        return found.most_common(1)[0][0] if found else ""

    def _infer(self) -> Rooms:
        config = RoomConfig()
        evidence = self._operations.ask(
            lambda mission: room_evidence(mission.voxel_map, config, mission.floor_z_m), TIMEOUT_S
        )
        return infer_rooms(evidence, config)

    def _reply(self, rooms: Rooms) -> RoomsReply:
        places = room_places(rooms, self.names)
        return RoomsReply(
            rooms=[
                Room(
                    x_m=round(place.x_m, 2),
                    y_m=round(place.y_m, 2),
                    area_m2=round(place.area_m2, 1),
                    kind=place.kind,
                    name=place.name,
                )
                for place in places
            ],
            note=self.problem,
        )

    def _read(
        self, path: Path, report_event: Callable[[str, str], None], *, map_was_read: bool
    ) -> None:
        """Read the kept names; a file that cannot be used is set aside."""
        refusal = f"{path.name} belongs to a map that is not there any more"
        if map_was_read:
            try:
                self.names = read_room_names(path)
            except MemoryFileError as error:
                refusal = str(error)
            else:
                return
        try:
            kept = f"kept as {set_aside(path).name}"
        except OSError as error:
            self._path = None
            kept = f"left where it is ({error.strerror}), and no names are kept in this run"
        self.problem = f"rooms have no names: {refusal}; the file is {kept}"
        report_event("error", self.problem)
