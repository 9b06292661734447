"""Cache of compiled kernels: one folder per state of their sources.

numba detects a change in the file of a kernel, but not in kernels or constants imported from other
modules, and would keep running the old ones.
"""

import contextlib
import hashlib
import os
import shutil
import time
from pathlib import Path
from typing import Final

import platformdirs

LIBRARY: Final = Path(__file__).parents[2] / "ippon"
KEPT: Final = 4
"""Number of earlier states to keep, for switching between versions."""
SPARED_S: Final = 86_400.0
"""Time after its last start for which a state is kept anyway: it may be running."""
COMPLETE: Final = "complete"
"""File in the folder that marks that it holds every kernel of the navigator."""
_MARKS: Final = (b"njit", b"Final", b"NamedTuple")


def use_kernel_cache() -> Path | None:
    """Set the folder for this state of the sources; call it before numba is imported.

    Returns:
        The folder; None if `NUMBA_CACHE_DIR` is set or no folder can be created; numba then stores
        its files beside the sources.
    """
    if "NUMBA_CACHE_DIR" in os.environ:
        return None
    parent = platformdirs.user_cache_path("ippon") / "kernels"
    folder = parent / state_of(LIBRARY)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        folder.touch()
    except OSError:
        return None
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    _forget_old(parent, folder)
    return folder


def state_of(library: Path) -> str:
    """Return a short hash of all modules with kernels or constants compiled into them."""
    digest = hashlib.sha256(str(library).encode())
    for path in sorted(library.rglob("*.py")):
        content = path.read_bytes()
        if any(mark in content for mark in _MARKS):
            digest.update(path.relative_to(library).as_posix().encode())
            digest.update(content)
    return digest.hexdigest()[:16]


def _forget_old(parent: Path, current: Path) -> None:
    with contextlib.suppress(OSError):
        others = [path for path in parent.iterdir() if path.is_dir() and path != current]
        others.sort(key=lambda path: path.stat().st_mtime, reverse=True)
        spared = time.time() - SPARED_S
        for path in others[KEPT:]:
            if path.stat().st_mtime < spared:
                shutil.rmtree(path, ignore_errors=True)
