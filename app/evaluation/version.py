"""Versions that a row depends on: this program, its commit, and libraries."""

import hashlib
import importlib.metadata
import importlib.util
import os
import platform
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from ippon import extensions
from ippon.evaluation.methods.method_table import METHODS, base_name

_LIBRARIES: Final = ("numpy", "numba", "ompl", "scipy")
_ROOT: Final = Path(__file__).resolve().parents[2]
_CODE: Final = ("app", "ippon")


def version_text(methods: Iterable[str]) -> str:
    """Return the versions on one line: "ippon 0.1.0 1a2b3c4, python 3.11, numpy 2.1.0".

    Args:
        methods: Of the evaluation; of installed ones the code is named, too, see `code_of`.
    """
    parts = [f"ippon {importlib.metadata.version('ippon')} {_commit()}"]
    parts.append(f"python {platform.python_version()}")
    parts += [f"{name} {importlib.metadata.version(name)}" for name in _LIBRARIES]
    parts += dict.fromkeys(code for name in methods if (code := code_of(name)) is not None)
    return ", ".join(parts)


def program_of(version: str) -> str:
    """Return a version text without the code of installed methods, which differs between runs."""
    return ", ".join(part for part in version.split(", ") if " code " not in part)


def code_of(method: str) -> str | None:
    """Return name and digest of the code of an installed method: "mine code 1a2b3c4d".

    All Python files of its package count, values of its parameters do not. None for a method of
    this program: the commit names it.
    """
    module, name = None, base_name(method)
    if name not in METHODS:
        module = extensions.module_of(extensions.METHODS, name)
    spec = None if module is None else importlib.util.find_spec(module.partition(".")[0])
    if spec is None:
        return None
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    files = sorted(file for folder in folders for file in folder.rglob("*.py"))
    if not files and spec.origin is not None:
        files = [Path(spec.origin)]
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    return f"{name} code {digest[:8]}"


def _commit() -> str:
    """Return the commit of a checkout, with a digest of the code that differs from it.

    "1a2b3c4", "1a2b3c4+changes.5d6e7f80"; "installed" without a checkout.
    """
    if not (_ROOT / ".git").exists():
        return "installed"
    try:
        commit = _git("describe", "--always", "--abbrev=12").decode().strip()
        changes = _git("diff", "--no-ext-diff", "--no-textconv", "--binary", "HEAD", "--", *_CODE)
        added = _git("ls-files", "--others", "--exclude-standard", "-z", "--", *_CODE)
        for name in filter(None, added.split(b"\0")):
            changes += name + (_ROOT / os.fsdecode(name)).read_bytes()
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return f"{commit}+changes.{hashlib.sha256(changes).hexdigest()[:8]}" if changes else commit


def _git(*words: str) -> bytes:
    """Return what git says of the checkout; raises OSError or subprocess.SubprocessError."""
    return subprocess.run(  # noqa: S603 - fixed words, no shell
        ["git", "-C", str(_ROOT), *words],  # noqa: S607
        capture_output=True,
        check=True,
        # Does not write to the index, which another process may be using.
        env={**os.environ, "GIT_OPTIONAL_LOCKS": "0"},
        timeout=20,
    ).stdout
