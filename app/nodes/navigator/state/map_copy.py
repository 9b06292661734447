"""A copy of a kept map, with what is kept beside it, before another frame is mapped into it."""

import shutil
from pathlib import Path

from app.memory.memory_file import memory_path
from app.memory.room_names import room_names_path
from ippon.atomic_file import aside_name


def copy_aside(map_path: Path) -> Path:
    """Copy a kept map, its memory and its room names; the copy is a map of `--map` itself.

    Returns:
        The copy of the map.

    Raises:
        OSError: It cannot be copied.
    """
    aside = aside_name(map_path)
    for beside in (memory_path, room_names_path):
        if beside(map_path).exists():
            shutil.copy2(beside(map_path), beside(aside))
    shutil.copy2(map_path, aside)
    return aside
