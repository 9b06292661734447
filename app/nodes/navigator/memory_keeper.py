"""Keeps what the robot remembers: in the mission's thread, for requests, and in a file."""

import logging
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final

import simplejpeg

from app.errors import MemoryFileError
from app.memory.memory_file import journal_path, read_memory, read_picture, write_memory
from app.memory.wording import said_place, said_time
from app.messages.memory import MemoryNoteRequest
from ippon.atomic_file import set_aside
from ippon.frame import UNDERFOOT_M, Frame
from ippon.guidance.knowledge import WITHIN_REACH_M
from ippon.mapping.voxel_map import VoxelMap
from ippon.memory.best_view import better_views
from ippon.memory.instance import Instance, Point, is_on_floor
from ippon.memory.instance_memory import InstanceMemory, MemoryChanges
from ippon.memory.notes import checked_name, denied_labels
from ippon.mission.places.recollection import Recollection
from ippon.mission.search import Search
from ippon.rooms.named_rooms import RoomName, name_lookup
from ippon.rooms.room_inference import RoomConfig, infer_rooms, room_evidence
from ippon.vocabulary import in_words

logger = logging.getLogger(__name__)

SAVE_EVERY_S: Final = 10.0
ROOMS_EVERY_S: Final = 30.0
VIEWS_EVERY_S: Final = 1.0
_QUALITY: Final = 85


class MemoryKeeper:
    """Owns the memory of one navigator.

    Args:
        voxel_map: The map in whose frame things lie.
        robot: Key prefix of the robot.
        report_event: Reports what the operator should know.
        path: File of the memory; None keeps it only while the process runs.
        map_was_read: The map was read from its file, so that a kept memory fits it.
        room_names: Returns the names that people have given to rooms.
        map_waits: Returns whether the map may be of another frame: nothing is learned then.
    """

    def __init__(
        self,
        voxel_map: VoxelMap,
        robot: str,
        report_event: Callable[[str, str], None],
        path: Path | None = None,
        *,
        map_was_read: bool = False,
        room_names: Callable[[], tuple[RoomName, ...]] = tuple,
        map_waits: Callable[[], bool] = bool,
    ) -> None:
        self._map, self._robot, self._path = voxel_map, robot, path
        self._report_event = report_event
        self._room_names, self._map_waits = room_names, map_waits
        self._refused = self._unkept = ""
        """Why the kept memory was not read, and why it is not written now."""
        memory = InstanceMemory(instances=self._read(map_was_read=map_was_read))
        self._recollection = Recollection(voxel_map, memory)
        self.instances: tuple[Instance, ...] = memory.instances()
        """All things, for any thread."""
        self.labels = voxel_map.labels
        self._pictures: dict[int, bytes] = {}
        self._unwritten = MemoryChanges()
        self._lock = threading.Lock()
        self._writer: threading.Thread | None = None
        self._saved_at = self._rooms_at = time.monotonic()
        self._views_at = 0.0
        self._announced = 0
        self._room_at: Callable[[tuple[float, float]], str] = lambda _: ""
        self._floor_z_m = 0.0
        self._robot_z_m: float | None = None
        """Height of the floor under the robot; None before the first frame."""
        self._room_of: dict[Point, str] = {}

    @property
    def problem(self) -> str:
        """What is wrong with the kept memory, for the operator."""
        return self._unkept or self._refused

    def begin(self, *searches: Search) -> None:
        """Note what a search or a tour that begins finds.

        A search for one goal looks first where its object was seen before.
        """
        if len(searches) != 1:
            self._recollection.follow(searches)
            return
        recalled = self._recollection.begin(searches[0])
        now_ns = time.time_ns()
        for one in recalled:
            place = self._place_of(one)
            seen = said_time(one.last_seen_ns, now_ns)
            self._report_event("memory", f"{_name(one)} was last seen {seen}: {place}")

    def note(self, request: MemoryNoteRequest, searches: Iterable[Search]) -> Instance:
        """Keep what a person says of a thing, in the mission's thread.

        Args:
            request: What is said.
            searches: Those that go on.

        Raises:
            ValueError: There is no such thing, what is said makes no sense, or the memory cannot
                be written at present.
        """
        memory = self._recollection.memory
        one = memory.get(request.instance_id)
        if one is None:
            raise ValueError(f"there is no thing with number {request.instance_id} any more")
        if request.name is None and not request.deny and not request.allow:
            raise ValueError("nothing is said of the thing: give name, deny or allow")
        denied = denied_labels(one, request.deny, request.allow)
        name = one.name
        if request.name is not None:
            name = checked_name(request.name, one, self.instances, self.labels)
        if unkept := self._unkept:
            self._start_writer()  # The disk may have room by now.
            raise ValueError(unkept)
        noted = memory.note(one.instance_id, name=name, denied=denied)
        assert noted is not None, "it was there"
        for search in searches:
            self._recollection.exclude(search)
        self.instances = memory.instances()
        self._start_writer()
        return noted

    def step(self, frame: Frame, search: Search | None, floor_z_m: float) -> None:
        """Learn from a frame that the mission has decided on."""
        if self._map_waits():
            return
        self._robot_z_m = floor_z_m
        now_ns, now = time.time_ns(), time.monotonic()
        for one in self._recollection.step(search, now_ns):
            place = self._place_of(one)
            seen = said_time(one.last_seen_ns, now_ns)
            text = f"{_name(one)} is not there any more, last seen {seen}: {place}"
            self._report_event("memory", text)
        memory = self._recollection.memory
        if now - self._views_at >= VIEWS_EVERY_S:
            self._views_at = now
            for view in better_views(frame, memory.instances()):
                jpeg = simplejpeg.encode_jpeg(view.color, _QUALITY, "RGB", "420")
                with self._lock:
                    self._pictures[view.instance_id] = jpeg
                memory.set_view_score(view.instance_id, view.score)
            known = {one.instance_id for one in memory.instances()}
            with self._lock:
                self._pictures = {k: jpeg for k, jpeg in self._pictures.items() if k in known}
        before, self._announced = self._announced, len(search.finds) if search is not None else 0
        if self._announced > before or now - self._rooms_at >= ROOMS_EVERY_S:
            self._rooms_at, self._floor_z_m = now, floor_z_m
            config = RoomConfig()
            evidence = room_evidence(self._map, config, floor_z_m)
            self._room_at = name_lookup(infer_rooms(evidence, config), self._room_names())
            memory.set_rooms(self._room_at, floor_z_m)
        self.instances, self.labels = memory.instances(), self._map.labels
        if self._path is not None and now - self._saved_at >= SAVE_EVERY_S:
            self._saved_at = now
            self._start_writer()

    def room_of(self, position_world: Point) -> str:
        """Return the room of a find, in the mission's thread; empty where it is not clear.

        That of a find on another floor is what was said of it last.
        """
        height_m = position_world[2] - self._floor_z_m
        if -UNDERFOOT_M < height_m < WITHIN_REACH_M:
            room = self._room_at(position_world[:2])
            if room:
                self._room_of[position_world] = room
        return self._room_of.get(position_world, "")

    def _place_of(self, one: Instance) -> str:
        """Return where a thing is; its height is that above the robot's floor, if it is there."""
        z_m = self._robot_z_m
        is_here = z_m is not None and is_on_floor(one, z_m)
        return said_place(one.room, one.position_world, z_m if is_here else None)

    def picture(self, instance_id: int) -> bytes | None:
        """Return the picture of a thing as JPEG, from any thread; None where there is none."""
        with self._lock:
            jpeg = self._pictures.get(instance_id)
        if jpeg is not None or self._path is None or not self._path.exists():
            return jpeg
        try:
            return read_picture(self._path, instance_id)
        except MemoryFileError as error:
            logger.warning("%s", error)
            return None

    def close(self) -> None:
        """Write what is left, and wait until it is written."""
        if not self._map_waits():
            self._recollection.update(time.time_ns())
        if (writer := self._writer) is not None:
            writer.join()
        if self._path is not None:
            with self._lock:
                self._collect()
            self._write(self._path)
        if self.problem:
            logger.error("%s", self.problem)

    def _read(self, *, map_was_read: bool) -> tuple[Instance, ...]:
        """Read the kept memory; one that cannot be used is set aside."""
        path = self._path
        if path is None or not path.exists():
            return ()
        if not map_was_read:
            self._refuse(path, f"{path.name} belongs to a map that is not there any more")
            return ()
        try:
            return read_memory(path, self._robot)
        except MemoryFileError as error:
            self._refuse(path, str(error))
            return ()

    def _refuse(self, path: Path, why: str) -> None:
        """Set a file aside, and say so."""
        try:
            aside = set_aside(path)
            kept = f"kept as {aside.name}"
            if journal_path(path).exists():
                journal_path(path).rename(journal_path(aside))
        except OSError as failed:
            self._path = None
            kept = f"left where it is ({failed.strerror}), and nothing is kept in this run"
        self._refused = f"memory starts anew: {why}; the file is {kept}"
        self._report_event("error", self._refused)

    def _start_writer(self) -> None:
        """Have what changed written; a writer that is at work goes on with it."""
        if self._path is None:
            return
        with self._lock:
            self._collect()
            if self._writer is not None and self._writer.is_alive():
                return
            self._writer = threading.Thread(
                target=self._write_all, args=(self._path,), name="memory writer", daemon=True
            )
            self._writer.start()

    def _collect(self) -> None:
        """Add what changed to what waits to be written, in the mission's thread, with the lock."""
        changes = self._recollection.memory.take_changes()
        self._unwritten = _merged(self._unwritten, changes)

    def _write_all(self, path: Path) -> None:
        while self._write(path):
            pass

    def _write(self, path: Path) -> bool:
        """Write what waits; return whether more waits by now, else this is no writer any more."""
        with self._lock:
            changes, self._unwritten = self._unwritten, MemoryChanges()
            pictures = {k: j for k, j in self._pictures.items() if k not in changes.removed}
        try:
            write_memory(path, self._robot, changes, pictures)
        except MemoryFileError as error:
            if not self._unkept:
                self._report_event("error", str(error))
            self._unkept = str(error)
            with self._lock:
                self._unwritten = _merged(changes, self._unwritten)
                self._writer = None
            return False
        self._unkept = ""
        with self._lock:
            # Pictures that were replaced in the meantime are written the next time.
            left = {k: j for k, j in self._pictures.items() if pictures.get(k) is not j}
            self._pictures = left
            if self._unwritten.changed or self._unwritten.removed:
                return True
            self._writer = None
        return False


def _merged(earlier: MemoryChanges, later: MemoryChanges) -> MemoryChanges:
    kept = {k: one for k, one in earlier.changed.items() if k not in later.removed}
    return MemoryChanges(changed=kept | later.changed, removed=earlier.removed | later.removed)


def _name(one: Instance) -> str:
    return one.name or in_words(one.believed or one.label)
