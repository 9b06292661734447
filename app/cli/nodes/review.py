"""`ippon review`: the console on a recording, or a list of recordings to choose from."""

import logging
import signal
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from app.cli.options.nodes import Review
from app.errors import UsageError
from app.nodes.review.node import ReviewConfig, run_review
from app.nodes.review.recompute import recompute
from app.nodes.review.settings import read_settings
from app.process.parent_watch import end_with_parent
from app.process.stop_signal import interrupt
from app.recording.catalogue import is_folder_of_recordings
from app.recording.errors import RecordingError
from app.recording.reading.recording import Recording
from app.recording.session_folder import sessions_folder

logger = logging.getLogger(__name__)


def run_review_command(command: Review) -> int:
    """Serve the pages until the process is stopped."""
    # What was unpacked of a compressed bag is removed at the end.
    signal.signal(signal.SIGTERM, interrupt)
    end_with_parent(command.parent_pid)
    if command.out is not None and not (command.recompute or command.set):
        raise UsageError("--out is the folder of a recomputed session: add --recompute")
    paths = command.paths or (sessions_folder(),)
    try:
        if command.recompute or command.set:
            paths = (paths[0], recomputed(paths, command.set, command.out))
        run_review(review_config(paths, command.port, command.language))
    except RecordingError as error:
        raise UsageError(str(error)) from error
    return 0


def recomputed(paths: tuple[Path, ...], changes: tuple[str, ...], out: Path | None) -> Path:
    """Recompute a session and return the new one's folder.

    Raises:
        UsageError: There is not exactly one recording.
        RecordingError: It cannot be recomputed.
    """
    if len(paths) != 1:
        raise UsageError(f"one recording is recomputed at a time; got {len(paths)}")
    recording = Recording(paths[0])
    try:
        settings = read_settings(recording, changes)
        root = out or recording.path.parent / "recomputed"
        with Progress(console=Console(file=sys.stderr), transient=True) as progress:
            task = progress.add_task("recomputing", total=1.0)
            folder = recompute(
                recording, settings, root, lambda share: progress.update(task, completed=share)
            )
    finally:
        recording.close()
    logger.info("recomputed to %s", folder)
    return folder


def review_config(paths: tuple[Path, ...], port: int, language: str = "en") -> ReviewConfig:
    """Return the configuration: recordings to show, or a folder of sessions to list.

    Raises:
        UsageError: There are more than two recordings.
    """
    if len(paths) > 2:
        raise UsageError(f"one recording is shown, or two side by side; got {len(paths)}")
    if len(paths) == 1 and is_folder_of_recordings(paths[0]):
        return ReviewConfig(folder=paths[0], port=port, language=language)
    return ReviewConfig(paths=paths, port=port, language=language)
