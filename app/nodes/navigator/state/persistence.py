"""Saves the map and the unfinished goals for the next start of the navigator.

The map is one file (see `ippon.mapping.map_file`), the goals are JSON beside it. Both are replaced
atomically, so that a crash leaves the previous version. A third file exists while the navigator
runs: who finds it at a start knows that the last run was killed, and what it did then.
"""

import contextlib
import logging
import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import msgspec

from app.messages.control import SearchRequest, decode
from app.messages.driving import DriveModeName
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.state.planned_search import PlannedSearch
from app.process.boot import boot_time
from ippon.atomic_file import remove_partial_files, replace_file
from ippon.errors import MapFileError
from ippon.guidance.levels import LevelName
from ippon.mapping import map_file
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.snapshot import Find

logger = logging.getLogger(__name__)

SAVE_EVERY_S: Final = 10.0
FIRST_AFTER_S: Final = 5.0
AGAIN_S: Final = 1.0
RECENT_S: Final = 120.0
"""Age of the last sign of a killed run from which the next one does not go on by itself: the robot
may have been moved."""


class SavedFind(msgspec.Struct, frozen=True, kw_only=True):
    """Something that was found, for the search that goes on."""

    position_world: tuple[float, float, float]
    """Centroid, metres."""
    size_m: tuple[float, float, float]
    probability: float
    voxels: int
    number: int = 0
    confirmed: bool = False

    @classmethod
    def of(cls, find: Find) -> "SavedFind":
        """Return what is kept of a find."""
        kept = {name: getattr(find, name) for name in cls.__struct_fields__}
        return cls(**kept)

    def find(self) -> Find:
        """Return it as a find of the next run."""
        return Find(**msgspec.structs.asdict(self), box_px=None)


class SavedGoal(SearchRequest, frozen=True, kw_only=True):
    """A goal as requested, with the levels that the operator set."""

    object: str
    """As it was understood, which may be longer than what may be asked for."""
    levels: dict[str, LevelName] = msgspec.field(default_factory=dict[str, LevelName])
    """Levels that the operator set, by label."""
    counted: list[SavedFind] = msgspec.field(default_factory=list[SavedFind])
    """What was found before, of a goal of which several are wanted."""
    rejected: list[SavedFind] = msgspec.field(default_factory=list[SavedFind])
    """What was found and rejected."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SavedState:
    """Map and goals of an earlier navigator."""

    voxel_map: VoxelMap | None
    """None if no map was written before it ended."""
    requests: tuple[SavedGoal, ...]
    """The active goal and the queued ones, in order."""
    interrupted: "RunState | None" = None
    """What the last run did when it was killed; None if it ended by itself, or long ago."""


class RunState(msgspec.Struct, frozen=True, kw_only=True):
    """What a navigator does, for the one that follows it after a crash."""

    held: bool
    """The operator has stopped or paused it."""
    mode: DriveModeName
    speed_limit: float

    @property
    def may_go_on(self) -> bool:
        """Whether its successor may move the robot without asking."""
        return not self.held and self.mode == "auto"


class _KeptRun(msgspec.Struct, frozen=True):
    """The file of a run. One of an earlier version cannot be decoded: the robot waits."""

    run: RunState
    boot: str
    at_s: float
    """See `boot_time`."""


def read_saved_state(path: Path, config: MapConfig) -> SavedState | None:
    """Read map and goals; None where neither file exists.

    Raises:
        MapFileError: The file is damaged, no map, or of another voxel size; or the goals cannot be
            decoded.
        OSError: It cannot be read.
    """
    goals = _goals_path(path)
    if not path.exists() and not goals.exists():
        return None
    voxel_map = None
    if path.exists():
        voxel_map = VoxelMap.load(path, config)
        voxel_map.set_ooi(None)
    requests: list[SavedGoal] = []
    if goals.exists():
        try:
            requests = decode(goals.read_bytes(), list[SavedGoal])
        except msgspec.MsgspecError as error:
            raise MapFileError(f"{goals.name} holds no goals: {error}; remove it") from error
    return SavedState(
        voxel_map=voxel_map, requests=tuple(requests), interrupted=_read_run_state(_run_path(path))
    )


class _SmallFiles:
    """Replaces files in a thread of its own: while a disk is busy that can take seconds."""

    def __init__(self, on_failure: Callable[[Path, OSError], None]) -> None:
        self._on_failure = on_failure
        self._waiting: dict[Path, bytes] = {}
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def put(self, path: Path, content: bytes) -> None:
        """Replace a file soon; of several contents that wait the last one counts."""
        with self._lock:
            self._waiting[path] = content
            if self._thread is None:
                self._thread = threading.Thread(
                    target=self._write, name="state writer", daemon=True
                )
                self._thread.start()

    def wait(self) -> None:
        """Wait until everything is written."""
        with self._lock:
            thread = self._thread
        if thread is not None:
            thread.join()

    def _write(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    self._thread = None
                    return
                # In their order: a Stop is kept after the goal that it holds.
                path = next(iter(self._waiting))
                content = self._waiting.pop(path)
            try:
                replace_file(path, content)
            except OSError as error:
                self._on_failure(path, error)


class StatePersistence:
    """Writes the map at intervals and the goals when they change, in threads of its own."""

    def __init__(
        self,
        path: Path,
        report_event: Callable[[str, str], None],
        every_s: float = SAVE_EVERY_S,
        map_waits: Callable[[], bool] = bool,
    ) -> None:
        """Write to a file.

        Args:
            path: The map's file.
            report_event: Reports an error once, until writing works again.
            every_s: Interval between two writes of the map.
            map_waits: Returns whether the map that was read must stay in the file as it is.
        """
        self._path = path
        self._map_waits = map_waits
        self._report_event = report_event
        self._every_s = every_s
        self._due_at = time.monotonic() + min(FIRST_AFTER_S, every_s)
        self._revision = -1
        self._goals: bytes | None = None
        self._writer: threading.Thread | None = None
        self._problem = ""
        self._reported = False
        self._run: tuple[RunState, float] | None = None
        self._again_at = math.inf  # When a state that could not be written is tried again.
        self._small = _SmallFiles(self._fail)
        for one in (path, _goals_path(path), _run_path(path)):
            remove_partial_files(one)

    def keep_state(self, goals: GoalQueue, run: RunState) -> None:
        """Write goals and state when they change, also while no frame comes."""
        kept, again_at = self._run, self._again_at
        if kept is None or kept[0] != run or time.monotonic() >= again_at:
            self._again_at = math.inf
            self._put_run(run)
        if self._problem and not self._reported:
            self._reported = True
            self._report_event("error", self._problem)
        self._keep_goals(goals)

    def keep_map(self, voxel_map: VoxelMap) -> None:
        """Write the map, if it is due: called by the mission's thread after every step."""
        kept = self._run
        if kept is not None and time.monotonic() - kept[1] >= self._every_s:
            # A robot that was not heard for long may have been moved: the time is that of a frame.
            self._put_run(kept[0])
        if time.monotonic() < self._due_at or (self._writer and self._writer.is_alive()):
            return
        if self._map_waits():
            return
        self._due_at = time.monotonic() + self._every_s
        if voxel_map.revision != self._revision:
            self._revision = voxel_map.revision
            # Copied in the mission's thread; compressed and written in another.
            content = voxel_map.capture()
            self._writer = threading.Thread(
                target=self._write, args=content, name="map writer", daemon=True
            )
            self._writer.start()

    def close(self, voxel_map: VoxelMap, goals: GoalQueue) -> None:
        """Write map and goals, and wait until they are written."""
        if self._writer is not None:
            self._writer.join()
        self._keep_goals(goals)
        self._small.wait()
        if self._map_waits():
            logger.warning(
                "%s stays as it was: too little of it was in view to know that the robot's frame "
                "is the same", self._path.name,
            )  # fmt: skip
        else:
            self._write(*voxel_map.capture())
        _run_path(self._path).unlink(missing_ok=True)
        if self._problem:
            logger.error("%s", self._problem)

    def _write(self, header: dict[str, object], arrays: map_file.Arrays) -> None:
        try:
            map_file.write(self._path, header, arrays)
        except OSError as error:
            self._problem = f"the map is not kept in {self._path.name}: {error.strerror or error}"
            self._revision = -1
        else:
            self._problem, self._reported = "", False

    def _put_run(self, run: RunState) -> None:
        self._run = run, time.monotonic()
        kept = _KeptRun(run, *boot_time())
        self._small.put(_run_path(self._path), msgspec.json.encode(kept))

    def _keep_goals(self, goals: GoalQueue) -> None:
        content = msgspec.json.encode(_requests_of(goals.unfinished()))
        if content == self._goals:
            return
        self._goals = content
        self._small.put(_goals_path(self._path), content)

    def _fail(self, path: Path, error: OSError) -> None:
        reason = error.strerror or error
        if path == _goals_path(self._path):
            self._goals = None
            self._problem = f"the goals are not kept in {path.name}: {reason}"
        else:
            self._again_at = time.monotonic() + AGAIN_S
            self._problem = f"the state is not kept in {path.name}: {reason}"
            # The last state is obsolete, and to remove it needs no space: a Stop is not forgotten.
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)


def persistence_of(
    keep_map: str, report_event: Callable[[str, str], None], map_waits: Callable[[], bool]
) -> StatePersistence | None:
    """Return what keeps the state beside a map; None where none is to be kept."""
    if not keep_map:
        return None
    return StatePersistence(Path(keep_map), report_event, map_waits=map_waits)


def _goals_path(path: Path) -> Path:
    return path.with_name(path.name + ".goals.json")


def _run_path(path: Path) -> Path:
    return path.with_name(path.name + ".run.json")


def _read_run_state(path: Path) -> RunState | None:
    """Return the state of a run that was killed a moment ago."""
    try:
        kept = decode(path.read_bytes(), _KeptRun)
    except (OSError, msgspec.MsgspecError):
        return None
    boot, now_s = boot_time()
    is_recent = kept.boot == boot and 0.0 <= now_s - kept.at_s <= RECENT_S
    return kept.run if is_recent else None


def _requests_of(searches: Sequence[PlannedSearch]) -> list[SavedGoal]:
    """Return the requests that repeat some searches; those of a tour join its first one."""
    # The next navigator numbers its goals from 1 in this order.
    first: dict[int, int] = {}
    for number, search in enumerate(searches, 1):
        first.setdefault(search.tour, number)
    return [
        _request_of(search, None if first[search.tour] == number else first[search.tour])
        for number, search in enumerate(searches, 1)
    ]


def _request_of(search: PlannedSearch, joins: int | None) -> SavedGoal:
    return SavedGoal(
        object=search.goal.display,
        context=search.goal.context,
        scenario=search.scenario,
        joins=joins,
        attributes=list(search.goal.attributes),
        count=search.goal.count,
        other=search.goal.other,
        levels={edit.label: edit.level.text for edit in search.edits},
        counted=[SavedFind.of(find) for find in search.counted],
        rejected=[SavedFind.of(find) for find in search.rejected],
    )
