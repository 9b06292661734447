"""Compilation of kernels: for which processor, and in which process.

Kernels take `njit` from here, so that it is set up before numba compiles the first of them.
"""

import contextlib
import subprocess
import sys
from collections.abc import Generator
from typing import Any

import numba
from llvmlite import binding
from numba.core import config

__all__ = ["compile_in_second_process", "njit"]


def use_wide_vectors() -> None:
    """Let kernels use vectors of 512 bits where they are fast.

    LLVM prefers 256 bits on all processors of Intel, because 512 lower the clock of the early ones.
    Those with arithmetic in half precision (Sapphire Rapids and later) came after that; there the
    map's update of blocks takes a fifth less. `NUMBA_CPU_FEATURES` has the last word.
    """
    settings: dict[str, Any] = config.__dict__
    if settings["CPU_FEATURES"] is not None or not settings["ENABLE_AVX"]:
        return
    try:
        features = binding.get_host_cpu_features()
    except RuntimeError:
        # No features are known of this kind of processor.
        return
    if features.get("avx512fp16"):
        settings["CPU_FEATURES"] = f"{features.flatten()},-prefer-256-bit"


use_wide_vectors()


def njit(*, allocates: bool = False, **options: Any) -> Any:
    """Compile a kernel; a decorator with the options of numba's own.

    Args:
        allocates: Whether the kernel makes arrays. Only then numba counts references, with an
            atomic operation for each array of each slice and of each tuple that is passed on. The
            others borrow their arrays from the caller, and may return none: numba's `_nrt=False`,
            which its own sorting uses, though its name says that it may change.
        options: See numba's `jit`.
    """
    compiled: Any = numba.njit
    return compiled(_nrt=allocates, **options)


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
