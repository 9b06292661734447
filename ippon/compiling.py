"""Compiling kernels in two processes at once."""

import contextlib
import subprocess
import sys
from collections.abc import Generator


@contextlib.contextmanager
def compile_beside(module: str, function: str) -> Generator[None]:
    """Call a function in a process of its own meanwhile; waits for it where the block ends.

    What it compiles is kept on disk and loaded from there. What it did not get done, for whatever
    reason, is compiled where it is needed.

    Args:
        module: Where the function is, for example "ippon.mapping.warm_up".
        function: Its name; it takes no arguments.
    """
    beside = subprocess.Popen(  # noqa: S603, both names are the program's own
        [sys.executable, "-c", f"from {module} import {function} as go; go()"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
        beside.wait()
    finally:
        beside.kill()
        beside.wait()
