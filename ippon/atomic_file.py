"""Files that are there whole or not at all."""

import os
import threading
from pathlib import Path


def replace_file(path: Path, content: bytes, *, mode: int = 0o666) -> None:
    """Write a file in the place of another: a crash or a power cut leaves either, whole.

    Args:
        path: The file; its folder is there. Writers in other threads and processes do no harm: one
            of them is last.
        content: What it will hold.
        mode: Permissions of the file, less the process's umask.

    Raises:
        OSError: It cannot be written; what was there stays, and nothing is left beside it.
    """
    partial = path.with_name(f"{path.name[:99]}.{threading.get_native_id()}.partial")
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
