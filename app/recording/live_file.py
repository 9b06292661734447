"""Whether a recording is still being written: its recorder holds a lock on the file.

A file without an index is either being written or was cut off. The lock tells them apart, because
the system removes it when the recorder ends, however it ends.
"""

import fcntl
from contextlib import suppress
from pathlib import Path
from typing import IO


def hold(file: IO[bytes]) -> None:
    """Mark an open file as being written until it is closed."""
    with suppress(OSError):  # Some network file systems have no locks.
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def is_held(path: Path) -> bool:
    """Return whether a process is writing a file.

    Raises:
        OSError: It cannot be opened.
    """
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:  # Some network file systems have no locks.
            return False
    return False
