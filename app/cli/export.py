"""`ippon export`: a recording as files for other programs and other people."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from rich.console import Console

from app.cli.errors import UsageError
from app.cli.options import Export
from app.export.geometry import write_faces, write_points
from app.export.report import write_report
from app.export.scene_file import write_scene
from app.export.story import Story, open_story
from app.export.tables import write_csv, write_finds, write_tum
from app.export.video import write_camera_video, write_scene_video
from app.recording.errors import RecordingError

Write = Callable[[Story, Path], None]
PLAIN: Final[dict[str, tuple[str, Write]]] = {
    "tum": ("trajectory.tum", write_tum),
    "csv": ("trajectory.csv", write_csv),
    "finds": ("finds.json", write_finds),
    "camera": ("camera.mp4", write_camera_video),
    "map-video": ("map.mp4", write_scene_video),
    "report": ("report.html", write_report),
    "viser": ("scene.viser", write_scene),
    "page": ("scene.html", write_scene),
}
COLORED: Final = {"ply": ("map.ply", write_points), "glb": ("map.glb", write_faces)}


def run_export(command: Export) -> int:
    """Write what was asked for; what cannot be written is said, and the rest is."""
    writers = _writers(command)
    screen = Console(highlight=False, soft_wrap=True)
    try:
        story = open_story(command.recording)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    out = command.out or story.recording.path.parent / "export"
    failed = 0
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, write in writers.items():
            started = time.perf_counter()
            try:
                write(story, out / name)
            except RecordingError as error:
                failed += 1
                screen.print(f"{name}: {error}", style="yellow", markup=False)
                continue
            size, seconds = (out / name).stat().st_size, time.perf_counter() - started
            screen.print(f"{out / name}  {size / 1e6:.2f} MB  {seconds:.1f} s", markup=False)
    except OSError as error:
        raise UsageError(f"cannot write to {out}: {error.strerror}") from error
    finally:
        story.recording.close()
    return 1 if failed else 0


def _writers(command: Export) -> dict[str, Write]:
    known = (*COLORED, *PLAIN)
    wanted = known if not command.what else tuple(command.what)
    unknown = [name for name in wanted if name not in known]
    if unknown:
        raise UsageError(
            f"there is no {', '.join(unknown)} to export; there are {', '.join(known)}"
        )
    writers: dict[str, Write] = {}
    for name in wanted:
        if name in COLORED:
            file_name, write = COLORED[name]
            writers[file_name] = partial(write, mode=command.color)
        else:
            file_name, plain = PLAIN[name]
            writers[file_name] = plain
    return writers
