"""Lock on a file that a process holds while it runs.

The system removes it when the process ends, however it ends, and it is seen from other containers,
where the numbers of processes are others.
"""

import fcntl
from contextlib import suppress
from pathlib import Path
from typing import IO


def hold(file: IO[bytes]) -> None:
    """Lock an open file until it is closed."""
    with suppress(OSError):  # Some network file systems have no locks.
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def is_held(path: Path, *, unknown: bool = False) -> bool:
    """Return whether a process holds a file; `unknown` where the file system has no locks.

    Raises:
        OSError: It cannot be opened.
    """
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return unknown
    return False
