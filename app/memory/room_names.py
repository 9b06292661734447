"""Names that people have given to rooms, in a JSON file beside the map."""

from pathlib import Path
from typing import Final

import msgspec

from app.errors import MemoryFileError
from app.messages.control import decode
from ippon.atomic_file import replace_file
from ippon.rooms.named_rooms import RoomName

SUFFIX: Final = ".rooms.json"
MAX_NAME: Final = 40
MAX_ROOMS: Final = 200


def room_names_path(map_path: Path) -> Path:
    """Return where the names of a map's rooms are kept."""
    return map_path.with_name(map_path.name + SUFFIX)


def read_room_names(path: Path) -> tuple[RoomName, ...]:
    """Read the names; none where there is no file.

    Raises:
        MemoryFileError: The file is damaged or cannot be read.
    """
    try:
        if not path.exists():
            return ()
        return tuple(decode(path.read_bytes(), list[RoomName]))
    except (msgspec.MsgspecError, OSError) as error:
        raise MemoryFileError(f"{path.name} holds no names of rooms: {error}") from error


def write_room_names(path: Path, names: tuple[RoomName, ...]) -> None:
    """Replace the file.

    Raises:
        MemoryFileError: It cannot be written.
    """
    try:
        replace_file(path, msgspec.json.encode(names))
    except OSError as error:
        raise MemoryFileError(
            f"the names of rooms are not kept in {path.name}: {error.strerror or error}"
        ) from error


def checked_name(name: str) -> str:
    """Return a name of a room without spaces around it; empty to remove one.

    Raises:
        ValueError: It is too long or holds control characters.
    """
    clean = " ".join(name.split())
    if len(clean) > MAX_NAME or not all(c.isprintable() for c in clean):
        raise ValueError(
            f"a room's name has at most {MAX_NAME} printable characters; got {len(clean)}"
        )
    return clean
