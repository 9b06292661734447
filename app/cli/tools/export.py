"""`ippon export`: a recording as files for other programs."""

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from app.cli.options.tools import Export
from app.errors import UsageError
from app.export.geometry import write_faces, write_points
from app.export.mesh import write_mesh
from app.export.report import write_report
from app.export.scene_file import write_scene
from app.export.session_data import OnProgress, SessionData, read_session_data
from app.export.tables import write_csv, write_finds, write_tum
from app.export.video import NEEDS, can_write, write_camera_video, write_scene_video
from app.recording.errors import RecordingError
from ippon import extensions

Write = Callable[[SessionData, Path], None]
Slow = Callable[[SessionData, Path, OnProgress], None]
PLAIN: Final[dict[str, tuple[str, Write]]] = {
    "tum": ("trajectory.tum", write_tum),
    "csv": ("trajectory.csv", write_csv),
    "finds": ("finds.json", write_finds),
    "report": ("report.html", write_report),
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
VIDEOS: Final = ("camera", "map-video")


def run_export(command: Export) -> int:
    """Write the requested files; report those that cannot be written and continue."""
    writers = _writers(command)
    screen = Console(highlight=False, soft_wrap=True)
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(),
        console=screen, transient=True, disable=not screen.is_terminal,
    )  # fmt: skip
    with bar:
        reading = bar.add_task("reading", total=1.0)
        try:
            session = read_session_data(
                command.recording, lambda share: bar.update(reading, completed=share)
            )
        except RecordingError as error:
            raise UsageError(str(error)) from error
        bar.remove_task(reading)
        out = command.out or session.recording.path.parent / "export"
        try:
            out.mkdir(parents=True, exist_ok=True)
            written = [_write(session, out / name, writers[name], bar) for name in writers]
        except OSError as error:
            raise UsageError(f"cannot write to {out}: {error.strerror}") from error
        finally:
            session.recording.close()
    return 0 if all(written) else 1


def _write(session: SessionData, path: Path, write: Slow, bar: Progress) -> bool:
    """Write one file with a progress bar; return whether there was something to write.

    Raises:
        OSError: The file cannot be written.
    """
    task = bar.add_task(path.name, total=1.0)
    started = time.perf_counter()
    try:
        write(session, path, lambda share: bar.update(task, completed=share))
    except RecordingError as error:
        bar.console.print(f"{path.name}: {error}", style="yellow", markup=False)
        return False
    finally:
        bar.remove_task(task)
    size, seconds = path.stat().st_size, time.perf_counter() - started
    bar.console.print(f"{path}  {size / 1e6:.2f} MB  {seconds:.1f} s", markup=False)
    return True


def _writers(command: Export) -> dict[str, Slow]:
    known = (*COLORED, *SLOW, *PLAIN, *extensions.names(extensions.EXPORTERS))
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
    for name in wanted:
        if name in SLOW:
            file_name, writers[file_name] = SLOW[name]
        elif name in COLORED:
            file_name, colored = COLORED[name]
            writers[file_name] = _at_once(partial(colored, mode=command.color))
        else:
            file_name, plain = PLAIN[name] if name in PLAIN else _added(name)
            writers[file_name] = _at_once(plain)
    return writers


def _added(name: str) -> tuple[str, Write]:
    try:
        return extensions.load(extensions.EXPORTERS, name)
    except extensions.ExtensionError as error:
        raise UsageError(str(error)) from error


def _at_once(write: Write) -> Slow:
    def writer(session: SessionData, path: Path, _: OnProgress) -> None:
        write(session, path)

    return writer
