"""What other installed packages add to this one, by Python entry points.

A package names its addition in its pyproject.toml, `[project.entry-points."ippon.methods"]`, and
is found once it is installed. docs/guides/extending.md lists the groups.
"""

from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final

from ippon.errors import IpponError

METHODS: Final = "ippon.methods"
"""`Method` of `ippon eval`."""
PROFILES: Final = "ippon.profiles"
"""Path of a robot profile (YAML)."""
SCENES: Final = "ippon.scenes"
"""Callable from the text behind the colon of NAME:TEXT, "" for none, to a `Scene`."""
SEGMENTATION: Final = "ippon.segmentation"
"""Callable from `SegmentationConfig` and the folder of checkpoints to a `Segmenter`."""
LANGUAGE_MODELS: Final = "ippon.language_models"
"""Callable from the time limit in seconds to a `LanguageModelInterface`."""
EXPORTERS: Final = "ippon.exporters"
"""Name of the file, and a callable from `SessionData` and its path."""


class ExtensionError(IpponError, ValueError):
    """An extension is missing or damaged; the text names it, its package and the reason."""


def names(group: str) -> tuple[str, ...]:
    """Return the names that installed packages add to a group, sorted."""
    return tuple(sorted(_found(group)))


def module_of(group: str, name: str) -> str | None:
    """Return the module that an installed package adds under a name; None for no such name."""
    point = _found(group).get(name)
    return None if point is None else point.module


def load(group: str, name: str) -> Any:
    """Return an addition.

    Raises:
        ExtensionError: There is none of that name, or its package cannot be imported.
    """
    found = _found(group)
    if name not in found:
        there = f"there are {', '.join(sorted(found))}" if found else "none is installed"
        raise ExtensionError(f"no installed package adds {name!r} to {group}; {there}")
    try:
        return found[name].load()
    except Exception as error:
        where = found[name].value
        raise ExtensionError(f"{name!r} of {group} ({where}) cannot be loaded: {error}") from error


def _found(group: str) -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=group)}
