"""`ippon export`: a recording as files for other programs."""

import sys
import time
from collections.abc import Callable, Container, Generator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from app.cli.options.tools import Export
from app.datasets.bag_robot import BagRobot, read_bag_robot
from app.errors import UsageError
from app.export.geometry import write_faces, write_points
from app.export.mesh import write_mesh
from app.export.report import ReportPart, part_of, write_report, write_reports
from app.export.scene_file import write_scene
from app.export.session_data import OnProgress, SessionData, read_session_data
from app.export.tables import write_csv, write_finds, write_tum
from app.export.video import NEEDS, can_write, write_camera_video, write_scene_video
from app.recording.catalogue import is_folder_of_recordings, recordings_in
from app.recording.errors import RecordingError
from app.robot_file import RobotFileError
from app.view.words import ENGLISH, Words
from ippon import extensions

Write = Callable[[SessionData, Path], None]
Slow = Callable[[SessionData, Path, OnProgress], None]
PLAIN: Final[dict[str, tuple[str, Write]]] = {
    "tum": ("trajectory.tum", write_tum),
    "csv": ("trajectory.csv", write_csv),
    "finds": ("finds.json", write_finds),
    "viser": ("scene.viser", write_scene),
    "page": ("scene.html", write_scene),
}
COLORED: Final = {"ply": ("map.ply", write_points), "glb": ("map.glb", write_faces)}
SLOW: Final[dict[str, tuple[str, Slow]]] = {
    "mesh": ("mesh.ply", write_mesh),
    "camera": ("camera.mp4", write_camera_video),
    "map-video": ("map.mp4", write_scene_video),
}
"""Exports that read the whole file and report progress."""
REPORT: Final = "report.html"
OURS: Final = (*COLORED, *SLOW, *PLAIN, "report")
VIDEOS: Final = ("camera", "map-video")


def run_export(command: Export) -> int:
    """Write the requested files; report those that cannot be written and continue."""
    say = Words(command.language)
    recordings, command = _recordings_of(command)
    try:
        robot = read_bag_robot(command.profile, command.base_frame)
    except RobotFileError as error:
        raise UsageError(str(error)) from error
    writers = _writers(command, say)
    screen = Console(highlight=False, soft_wrap=True)
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(),
        console=screen, transient=True, disable=not screen.is_terminal,
    )  # fmt: skip
    with bar:
        if len(recordings) > 1:
            return _report_all(command, recordings, robot, say, bar)
        try:
            session = _read(recordings[0], bar, robot)
        except RecordingError as error:
            raise UsageError(str(error)) from error
        out = command.out or _folder_of(session)
        try:
            out.mkdir(parents=True, exist_ok=True)
            written = [_write(session, out / name, writers[name], bar) for name in writers]
        except OSError as error:
            raise UsageError(f"cannot write to {out}: {error.strerror}") from error
        finally:
            session.recording.close()
    return 0 if all(written) else 1


def _folder_of(session: SessionData) -> Path:
    """Return where a session is exported to; recordings in one folder have one each."""
    path = session.recording.path
    return path.parent / ("export" if session.is_alone else f"export-{path.stem}")


def _recordings_of(command: Export) -> tuple[list[Path], Export]:
    """Return the recordings that a command names, and the command with what to export alone."""
    known = _known()
    others = [name for name in command.what if name not in known]
    more = [Path(name) for name in others if Path(name).exists() or len(Path(name).parts) > 1]
    what = tuple(name for name in command.what if name in known or Path(name) not in more)
    recordings: list[Path] = []
    for path in (command.recording, *more):
        inside = recordings_in(path) if is_folder_of_recordings(path) else []
        recordings += inside or [path]
    if len(recordings) > 1 and what != ("report",):
        raise UsageError(
            f"{len(recordings)} recordings fit into a report only: `ippon export … report`; for "
            "anything else name one recording"
        )
    return recordings, replace(command, what=what)


def _report_all(
    command: Export, recordings: list[Path], robot: BagRobot, say: Words, bar: Progress
) -> int:
    """Write one report of several recordings; skip those that cannot be read, and say so."""
    parts: list[ReportPart] = []
    for path in recordings:
        try:
            session = _read(path, bar, robot)
        except RecordingError as error:
            bar.console.print(f"skipped: {error}", style="yellow", markup=False)
            continue
        try:
            parts.append(part_of(session, say))
        finally:
            session.recording.close()
    if not parts:
        raise UsageError("none of these recordings can be read")
    parent = command.recording if command.recording.is_dir() else command.recording.parent
    out = command.out or parent / "export"
    try:
        out.mkdir(parents=True, exist_ok=True)
        with _completed(out / REPORT) as path:
            write_reports(parts, path, say)
    except OSError as error:
        raise UsageError(f"cannot write to {out}: {error.strerror}") from error
    size = (out / REPORT).stat().st_size
    bar.console.print(f"{out / REPORT}  {size / 1e6:.2f} MB", markup=False)
    return 0 if len(parts) == len(recordings) else 1


def _read(path: Path, bar: Progress, robot: BagRobot) -> SessionData:
    """Read a recording with a progress bar.

    Raises:
        RecordingError: It cannot be read.
    """
    reading = bar.add_task(f"reading {path.name}", total=1.0)
    try:
        return read_session_data(path, lambda share: bar.update(reading, completed=share), robot)
    finally:
        bar.remove_task(reading)


def _write(session: SessionData, path: Path, write: Slow, bar: Progress) -> bool:
    """Write one file with a progress bar; return whether there was something to write.

    Raises:
        OSError: The file cannot be written.
    """
    task = bar.add_task(path.name, total=1.0)
    started = time.perf_counter()
    try:
        with _completed(path) as partial:
            write(session, partial, lambda share: bar.update(task, completed=share))
    except RecordingError as error:
        bar.console.print(f"{path.name}: {error}", style="yellow", markup=False)
        return False
    finally:
        bar.remove_task(task)
    size, seconds = path.stat().st_size, time.perf_counter() - started
    bar.console.print(f"{path}  {size / 1e6:.2f} MB  {seconds:.1f} s", markup=False)
    return True


@contextmanager
def _completed(path: Path) -> Generator[Path]:
    """Yield a path to write to; the file gets its name when it is complete."""
    partial = path.with_name(f"{path.stem}.partial{path.suffix}")
    try:
        yield partial
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _known() -> tuple[str, ...]:
    return (*OURS, *extensions.names(extensions.EXPORTERS))


def _writers(command: Export, say: Words = ENGLISH) -> dict[str, Slow]:
    known = _known()
    wanted = tuple(command.what or known)
    if not command.what and not can_write():
        print(f"ippon: {NEEDS}; the rest is written", file=sys.stderr)
        wanted = tuple(name for name in wanted if name not in VIDEOS)
    unknown = [name for name in wanted if name not in known]
    if unknown:
        raise UsageError(
            f"there is no {', '.join(unknown)} to export; there are {', '.join(known)}"
        )
    writers: dict[str, Slow] = {}
    # Ours first: an installed one may not take the place of one of our files.
    for name in sorted(wanted, key=lambda name: name not in OURS):
        if name in SLOW:
            file_name, writers[file_name] = SLOW[name]
        elif name in COLORED:
            file_name, colored = COLORED[name]
            writers[file_name] = _at_once(partial(colored, mode=command.color))
        elif name == "report":
            writers[REPORT] = _at_once(partial(write_report, say=say))
        elif name in PLAIN:
            file_name, plain = PLAIN[name]
            writers[file_name] = _at_once(plain)
        else:
            file_name, added = _added(name, writers, asked=bool(command.what))
            writers[file_name] = _at_once(added)
    return writers


def _added(name: str, taken: Container[str], *, asked: bool) -> tuple[str, Write]:
    """Return file and writer that an installed package adds.

    Args:
        name: Of the entry point.
        taken: Files that others write.
        asked: It was named by the command; else a damaged one is reported when it is its turn.

    Raises:
        UsageError: It was asked for, and is damaged, or writes a file of another.
    """
    try:
        match extensions.load(extensions.EXPORTERS, name):
            case (str() as file_name, _) if file_name in taken:
                why = f"{_title(name)} writes {file_name}, as another export does"
            case (str() as file_name, write) if callable(write):
                return file_name, partial(_write_added, name, write)
            case other:
                why = f"{_title(name)} is no pair of a file's name and a callable: {other!r}"
    except extensions.ExtensionError as error:
        why = str(error)
    if asked:
        raise UsageError(why)
    return name, partial(_refuse, why)


def _write_added(
    name: str, write: Callable[[SessionData, Path], object], session: SessionData, path: Path
) -> None:
    try:
        write(session, path)
    except RecordingError:
        raise
    except Exception as error:
        what = f"{type(error).__name__}: {error}"
        raise RecordingError(f"{_title(name)} has failed: {what}") from error
    if not path.is_file():
        raise RecordingError(f"{_title(name)} wrote no file")


def _refuse(why: str, _: SessionData, __: Path) -> None:
    raise RecordingError(why)


def _title(name: str) -> str:
    return f"{name!r} of {extensions.EXPORTERS}"


def _at_once(write: Write) -> Slow:
    def writer(session: SessionData, path: Path, _: OnProgress) -> None:
        write(session, path)

    return writer
