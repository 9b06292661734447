"""Versions that a row depends on: this program, its commit, and libraries."""

import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path
from typing import Final

_LIBRARIES: Final = ("numpy", "numba", "ompl", "scipy")


def version_text() -> str:
    """Return the versions on one line: "ippon 0.1.0 1a2b3c4, python 3.11, numpy 2.1.0"."""
    parts = [f"ippon {importlib.metadata.version('ippon')} {_commit()}"]
    parts.append(f"python {platform.python_version()}")
    parts += [f"{name} {importlib.metadata.version(name)}" for name in _LIBRARIES]
    return ", ".join(parts)


def _commit() -> str:
    """Return the commit of a checkout, marked when files differ from it; "installed" otherwise."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return "installed"
    try:
        run = subprocess.run(  # noqa: S603 - fixed words, no shell
            ["git", "-C", str(root), "describe", "--always", "--dirty=+changes", "--abbrev=12"],  # noqa: S607
            capture_output=True,
            check=True,
            # Does not write to the index, which another process may be using.
            env={**os.environ, "GIT_OPTIONAL_LOCKS": "0"},
            text=True,
            timeout=20,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return run.stdout.strip()
