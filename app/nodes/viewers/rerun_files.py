"""Files that Rerun's SDK writes."""

import itertools
import shutil
from pathlib import Path
from typing import Final

from app.nodes.viewers.errors import ViewerError

LEAST_FREE: Final = 64_000_000
"""Bytes left on a disk at which a recording ends: more than a few seconds take."""


def check_file(path: Path) -> None:
    """Create a file, or leave it as it is.

    Raises:
        ViewerError: It cannot be written.
    """
    try:
        path.open("ab").close()
    except OSError as error:
        raise ViewerError(f"{path} cannot be written: {error.strerror}") from error


def check_space(path: Path) -> None:
    """End a recording while it can still be completed.

    Once a write fails, the SDK waits for ever wherever its stream is used or released.

    Raises:
        ViewerError: There is no such file any more, or its disk is nearly full.
    """
    try:
        path.stat()
        free = shutil.disk_usage(path.parent).free
    except OSError as error:
        raise incomplete(path, error) from error
    if free < LEAST_FREE:
        raise ViewerError(f"{path} ends here: its disk has {free / 1e6:.0f} MB left")


def next_file(path: Path) -> Path:
    """Return a free name for another recording: search-2.rrd beside search.rrd."""
    names = (path.with_stem(f"{path.stem}-{n}") for n in itertools.count(2))
    return next(name for name in names if not name.exists())


def incomplete(path: Path, error: Exception) -> ViewerError:
    """Return the error of a file that lacks the end of a recording."""
    return ViewerError(f"{path} cannot be written any more, and is not complete: {error}")
