"""A child process that does not outlive the process that started it."""

import ctypes
import os
import signal
import sys
import threading
import time

_PR_SET_PDEATHSIG = 1


def end_with_parent(parent_pid: int | None) -> None:
    """Arrange for SIGTERM to this process when the parent is gone, even by SIGKILL.

    Args:
        parent_pid: The process to live with; None to live alone.
    """
    if parent_pid is None:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    # Covers systems without the call above, and a parent that was gone before it.
    thread = threading.Thread(target=_watch, args=(parent_pid,), name="parent", daemon=True)
    thread.start()


def _watch(parent_pid: int) -> None:
    while os.getppid() == parent_pid:
        time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGTERM)
