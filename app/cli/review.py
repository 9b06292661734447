"""`ippon review`: the console on a recording, or a list of recordings to choose from."""

import logging
from pathlib import Path

from app.cli.errors import UsageError
from app.cli.options import Review
from app.links.parent import end_with_parent
from app.nodes.console.node import ConsoleError
from app.nodes.review.node import ReviewConfig, run_review
from app.recording.errors import RecordingError
from app.recording.folders import sessions_folder
from app.recording.recording import Recording

logger = logging.getLogger(__name__)


def run_review_command(command: Review) -> int:
    """Serve the pages until the process is stopped."""
    end_with_parent(command.parent_pid)
    paths = command.paths or (sessions_folder(),)
    try:
        run_review(review_config(paths, command.port))
    except (ConsoleError, RecordingError) as error:
        raise UsageError(str(error)) from error
    return 0


def review_config(paths: tuple[Path, ...], port: int) -> ReviewConfig:
    """Tell recordings to open from a folder to list.

    Raises:
        UsageError: More than two.
        RecordingError: One cannot be opened.
    """
    if len(paths) > 2:
        raise UsageError(f"one recording is shown, or two beside each other; got {len(paths)}")
    if len(paths) == 1 and paths[0].is_dir() and not any(paths[0].glob("*.mcap")):
        return ReviewConfig(folder=paths[0], port=port)
    for path in paths:
        recording = Recording(path)
        for problem in recording.index.problems:
            logger.warning("%s: %s; what is there is shown", path, problem)
        recording.close()
    return ReviewConfig(paths=paths, port=port)
