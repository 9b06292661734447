"""Atomic replacement of files, and renaming of those that must not be replaced."""

import contextlib
import os
import re
import threading
from pathlib import Path


def replace_file(path: Path, content: bytes, *, mode: int = 0o666) -> None:
    """Replace a file atomically: a crash or power cut leaves the old file or the new one.

    Args:
        path: The file; its folder exists. With several writers, the last one wins.
        content: New content.
        mode: Permissions of the file, reduced by the process's umask.

    Raises:
        OSError: The file cannot be written; the old file remains, without temporary files.
    """
    partial = path.with_name(f"{_stem(path)}.{threading.get_native_id()}.partial")
    descriptor = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, mode)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def remove_partial_files(path: Path) -> None:
    """Remove what writers of a file left behind that were killed; none may write it now."""
    left_behind = re.compile(re.escape(_stem(path)) + r"\.\d+\.partial")
    with contextlib.suppress(OSError):
        for one in path.parent.iterdir():
            if left_behind.fullmatch(one.name):
                one.unlink(missing_ok=True)


def _stem(path: Path) -> str:
    return path.name[:99]


def aside_name(path: Path) -> Path:
    """Return a free name beside a file, for a copy that nothing is written over."""
    number = 1
    while (aside := path.with_name(f"{path.name}.aside-{number}")).exists():
        number += 1
    return aside


def set_aside(path: Path) -> Path:
    """Rename a file that cannot be used, so that nothing is written over it.

    Returns:
        Its new name.

    Raises:
        OSError: It cannot be renamed.
    """
    aside = aside_name(path)
    path.rename(aside)
    return aside
