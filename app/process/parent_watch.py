"""Ends a child process when its parent process ends."""

import ctypes
import os
import signal
import sys
import threading
import time

_PR_SET_PDEATHSIG = 1


def end_with_parent(parent_pid: int | None) -> None:
    """Send SIGTERM to this process when the parent has ended, even by SIGKILL.

    Args:
        parent_pid: Process id of the parent; None for no parent.
    """
    if parent_pid is None:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    # For systems without the call above, and for a parent that ended before it.
    thread = threading.Thread(target=_watch, args=(parent_pid,), name="parent", daemon=True)
    thread.start()


def _watch(parent_pid: int) -> None:
    while os.getppid() == parent_pid:
        time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGTERM)
