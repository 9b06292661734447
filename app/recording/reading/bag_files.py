"""The files of a recording: one, or the parts into which a recorder split a bag."""

import re
from pathlib import Path
from typing import Final

import yaml

from app.recording.errors import RecordingError
from app.yaml_text import parse_yaml

STORED: Final = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")
"""Endings of the files of recordings and rosbag2 folders."""
METADATA: Final = "metadata.yaml"
_PART: Final = re.compile(r"(.*?)_?(\d+)$")
_MOST_METADATA_BYTES: Final = 2**24


def files_of(path: Path) -> list[Path]:
    """Return the file of a path, or the parts of the bag in a folder, in order.

    The parts are those that metadata.yaml names, also those that are missing. Without it, as in a
    bag that was cut off, they are all files of one name that differ in the number at its end.

    Raises:
        RecordingError: There is no such file, or there are several that are not parts of one bag.
    """
    if not path.exists():
        raise RecordingError(f"there is no {path}")
    if not path.is_dir():
        return [path]
    files = stored_in(path)
    if not files:
        raise RecordingError(f"{path} holds no .mcap or .db3 file")
    named = _named_in_metadata(path)
    if set(files) <= set(named):
        return named
    # A recorder that was killed leaves the part that it compressed: whole, and half of it packed.
    files = [file for file in files if _unpacked(file) not in files]
    parts = files if len(files) == 1 else _numbered(files)
    if not parts:
        names = ", ".join(file.name for file in files[:3]) + (", …" if len(files) > 3 else "")
        raise RecordingError(f"{path} holds {len(files)} recordings, {names}: name one of them")
    return parts


def stored_in(folder: Path) -> list[Path]:
    """Return the files of recordings in a folder, in the order of their names."""
    return sorted(file for file in folder.iterdir() if file.name.endswith(STORED))


def is_one_bag(folder: Path) -> bool:
    """Return whether the files of a folder are one recording."""
    try:
        return bool(files_of(folder))
    except RecordingError:
        return False


def _named_in_metadata(folder: Path) -> list[Path]:
    """Return the parts that metadata.yaml names; none where it is missing or cannot be used."""
    try:
        text = (folder / METADATA).read_bytes()[:_MOST_METADATA_BYTES].decode()
        names = parse_yaml(text)["rosbag2_bagfile_information"]["relative_file_paths"]
        # Bags of ROS 2 Dashing and Eloquent have the name of the folder before that of the file.
        return [folder / Path(name).name for name in names]
    except (OSError, yaml.YAMLError, TypeError, KeyError, ValueError):
        return []


def _unpacked(file: Path) -> Path | None:
    """Return the path of a compressed file as it was before."""
    return file.with_suffix("") if file.suffix == ".zstd" else None


def _numbered(files: list[Path]) -> list[Path]:
    """Return files of one name and different numbers in the order of these; none for others."""
    found: dict[int, Path] = {}
    stems: set[tuple[str, str]] = set()
    for file in files:
        stem, dot, ending = file.name.partition(".")
        matched = _PART.fullmatch(stem)
        if matched is None:
            return []
        # The part that was written when the recorder was killed is not compressed yet.
        stems.add((matched[1], dot + ending.removesuffix(".zstd")))
        found[int(matched[2])] = file
    return [found[n] for n in sorted(found)] if len(stems) == 1 and len(found) > 1 else []
