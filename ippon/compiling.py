"""Compilation of kernels in a second process."""

import contextlib
import subprocess
import sys
from collections.abc import Generator


@contextlib.contextmanager
def compile_in_second_process(module: str, function: str) -> Generator[None]:
    """Call a function in a second process; wait for it at the end of the block.

    Kernels that it compiles are cached on disk and loaded from there. Those that it does not finish
    are compiled where they are needed.

    Args:
        module: Module of the function, for example "ippon.mapping.warm_up".
        function: Name of the function, which takes no arguments.
    """
    beside = subprocess.Popen(  # noqa: S603, both names are constants of the program
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
