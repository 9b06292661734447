"""A kept map and what is kept beside it, put aside before another frame is mapped into it."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec

from app.memory.memory_file import journal_path, memory_path
from app.memory.room_names import room_names_path
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.state.persistence import SavedState
from ippon.atomic_file import aside_name


def copy_aside(map_path: Path) -> Path:
    """Copy a kept map, its memory and its room names; the copy is a map of `--map` itself.

    Returns:
        The copy of the map.

    Raises:
        OSError: It cannot be copied.
    """
    return _put_aside(map_path, shutil.copy2)


def move_aside(map_path: Path) -> Path:
    """Rename a kept map, its memory and its room names; the result is a map of `--map` itself.

    Returns:
        The new name of the map.

    Raises:
        OSError: It cannot be renamed.
    """
    return _put_aside(map_path, shutil.move)


def new_map_for_tracking(
    config: NavigatorConfig, saved: SavedState | None
) -> tuple[SavedState | None, str]:
    """Put a kept map aside where the camera is tracked: each start begins another frame.

    Returns:
        The state to go on with, and what to tell the operator; empty for nothing.

    Raises:
        OSError: The map cannot be put aside.
    """
    if not config.profile.tracks_pose or saved is None or saved.voxel_map is None:
        return saved, ""
    aside = move_aside(Path(config.keep_map))
    note = (
        "a tracked camera begins another frame at each start: the map as it was is kept as "
        f"{aside.name}, and a new map begins"
    )
    return without_map(saved, note)


def without_map(saved: SavedState, note: str) -> tuple[SavedState, str]:
    """Return a state for another frame, in which nobody knows where the finds of the last one are.

    Args:
        saved: The state with its map.
        note: What to tell the operator.

    Returns:
        The state without map and finds: what was counted is counted anew. And the note, which says
        so if there were any.
    """
    if any(one.counted or one.rejected for one in saved.requests):
        told = "finds that were counted or rejected before are forgotten and may come again"
        note = f"{note}; {told}"
    requests = tuple(
        msgspec.structs.replace(one, counted=[], rejected=[]) for one in saved.requests
    )
    return replace(saved, voxel_map=None, requests=requests), note


def _put_aside(map_path: Path, put: Callable[[Path, Path], object]) -> Path:
    aside = aside_name(map_path)
    for beside in (memory_path, _journal_path, room_names_path):
        if beside(map_path).exists():
            put(beside(map_path), beside(aside))
    put(map_path, aside)
    return aside


def _journal_path(map_path: Path) -> Path:
    return journal_path(memory_path(map_path))
