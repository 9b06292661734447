"""Environment of a process of this program: threads, kernel cache, logging."""

import logging
import os
import sys
from typing import Final

from app.errors import UsageError
from app.process.kernel_cache import use_kernel_cache

LOG_LEVELS: Final = ("DEBUG", "INFO", "WARNING", "ERROR")


def prepare_process() -> None:
    """Set thread counts, kernel cache and logging, before numba, numpy or open3d is imported.

    Raises:
        UsageError: `IPPON_LOG` is not a log level.
    """
    prevent_spinning()
    use_kernel_cache()
    logging.basicConfig(
        level=_log_level(os.environ.get("IPPON_LOG", "INFO")),
        format="%(asctime)s %(levelname)-7s %(name)s: %(message)s",
        datefmt="%H:%M:%S",
        stream=sys.stderr,
    )
    for chatty in ("httpx2", "websockets"):
        # At INFO these libraries log every request and connection.
        logging.getLogger(chatty).setLevel(logging.WARNING)


def prevent_spinning() -> None:
    """Let idle threads of libraries sleep; call it before numpy, torch or open3d is imported.

    Spinning workers make kernels up to 13 times slower when the other core is busy.
    """
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    os.environ.setdefault("GOMP_SPINCOUNT", "0")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _log_level(name: str) -> str:
    if name.upper() not in LOG_LEVELS:
        raise UsageError(f"IPPON_LOG is one of {', '.join(LOG_LEVELS)}; got {name!r}")
    return name.upper()
