"""Files that Rerun's SDK writes."""

import itertools
from pathlib import Path

from app.nodes.viewers.errors import ViewerError


def check_file(path: Path) -> None:
    """Create a file, or leave it as it is.

    Raises:
        ViewerError: It cannot be written.
    """
    try:
        path.open("ab").close()
    except OSError as error:
        raise ViewerError(f"{path} cannot be written: {error.strerror}") from error


def size_of(path: Path) -> int:
    """Return how many bytes were written to a file.

    Raises:
        ViewerError: There is no such file any more.
    """
    try:
        return path.stat().st_size
    except OSError as error:
        raise incomplete(path, error) from error


def next_file(path: Path) -> Path:
    """Return a free name for another recording: search-2.rrd beside search.rrd."""
    names = (path.with_stem(f"{path.stem}-{n}") for n in itertools.count(2))
    return next(name for name in names if not name.exists())


def incomplete(path: Path, error: Exception) -> ViewerError:
    """Return the error of a file that lacks the end of a recording."""
    return ViewerError(f"{path} cannot be written any more, and is not complete: {error}")
