"""Remembered things and their pictures in one SQLite file beside the map.

The `application_id` of the file says that it is one, its `user_version` of which version. A write
is one transaction: a crash leaves the state before it or after it.
"""

import json
import sqlite3
from collections.abc import Generator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Final

from app.errors import MemoryFileError
from ippon.memory.instance import Instance
from ippon.memory.instance_memory import MemoryChanges

APPLICATION_ID: Final = 0x4950504D
"""IPPM in ASCII."""
VERSION: Final = 3
SUFFIX: Final = ".memory"
_SCHEMA: Final = """
CREATE TABLE about (robot TEXT NOT NULL);
CREATE TABLE instances (
    id INTEGER PRIMARY KEY, source TEXT NOT NULL, label TEXT NOT NULL, alternatives TEXT NOT NULL,
    probability REAL NOT NULL, x REAL NOT NULL, y REAL NOT NULL, z REAL NOT NULL,
    size_x REAL NOT NULL, size_y REAL NOT NULL, size_z REAL NOT NULL, voxels INTEGER NOT NULL,
    first_seen_ns INTEGER NOT NULL, last_seen_ns INTEGER NOT NULL, gone_ns INTEGER NOT NULL,
    room TEXT NOT NULL, view_score REAL NOT NULL, attributes TEXT NOT NULL,
    name TEXT NOT NULL DEFAULT '', denied TEXT NOT NULL DEFAULT '[]'
);
CREATE TABLE pictures (id INTEGER PRIMARY KEY, jpeg BLOB NOT NULL);
"""
_WITHOUT_NOTES: Final = 2
"""Version without what people say of things."""
_ADD_NOTES: Final = (
    "ALTER TABLE instances ADD COLUMN name TEXT NOT NULL DEFAULT ''",
    "ALTER TABLE instances ADD COLUMN denied TEXT NOT NULL DEFAULT '[]'",
)
_PUT: Final = "INSERT OR REPLACE INTO instances VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)"


def memory_path(map_path: Path) -> Path:
    """Return where the memory of a map is kept."""
    return map_path.with_name(map_path.name + SUFFIX)


def journal_path(path: Path) -> Path:
    """Return where SQLite keeps what undoes a write of a memory that was cut off."""
    return path.with_name(path.name + "-journal")


def read_memory(path: Path, robot: str | None = None) -> tuple[Instance, ...]:
    """Read all remembered things.

    Args:
        path: The file.
        robot: Key prefix of the robot whose memory it must be; None for any.

    Raises:
        MemoryFileError: There is no such file, or it is damaged, of another version or robot.
    """
    with _opened(path) as connection:
        damage = connection.execute("PRAGMA quick_check").fetchone()[0]
        if damage != "ok":
            raise MemoryFileError(f"{path.name} is damaged: {damage}")
        _check_version(path, connection)
        about = connection.execute("SELECT robot FROM about").fetchone()
        owner = "" if about is None else str(about[0])
        if robot is not None and owner != robot:
            raise MemoryFileError(
                f"{path.name} is the memory of robot {owner!r}; this one is {robot!r}"
            )
        rows = connection.execute("SELECT * FROM instances ORDER BY id").fetchall()
    try:
        return tuple(_instance_of(row) for row in rows)
    except (TypeError, ValueError) as error:
        raise MemoryFileError(f"{path.name} is damaged: {error}") from error


def read_picture(path: Path, instance_id: int) -> bytes | None:
    """Return the picture of a thing as JPEG; None where there is none.

    Raises:
        MemoryFileError: As `read_memory`.
    """
    with _opened(path) as connection:
        _check_version(path, connection)
        query = "SELECT jpeg FROM pictures WHERE id = ?"
        row = connection.execute(query, (instance_id,)).fetchone()
    return None if row is None else bytes(row[0])


def write_memory(
    path: Path, robot: str, changes: MemoryChanges, pictures: Mapping[int, bytes]
) -> None:
    """Write what changed; makes the file where there is none.

    Args:
        path: A file of this robot, or none.
        robot: Key prefix of the robot.
        changes: Things that are new, changed or forgotten.
        pictures: New pictures as JPEG, by number of the thing.

    Raises:
        MemoryFileError: The file cannot be written.
    """
    try:
        with closing(sqlite3.connect(path, timeout=5.0, isolation_level=None)) as connection:
            connection.execute("BEGIN IMMEDIATE")
            version = connection.execute("PRAGMA user_version").fetchone()[0]
            if version == _WITHOUT_NOTES:
                for statement in (*_ADD_NOTES, f"PRAGMA user_version = {VERSION}"):
                    connection.execute(statement)
            if version == 0:
                for statement in filter(str.strip, _SCHEMA.split(";")):
                    connection.execute(statement)
                connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
                connection.execute(f"PRAGMA user_version = {VERSION}")
                connection.execute("INSERT INTO about VALUES (?)", (robot,))
            removed = [(k,) for k in changes.removed]
            connection.executemany("DELETE FROM instances WHERE id = ?", removed)
            connection.executemany("DELETE FROM pictures WHERE id = ?", removed)
            rows = [_row_of(one) for one in changes.changed.values()]
            connection.executemany(_PUT, rows)
            connection.executemany(
                "INSERT OR REPLACE INTO pictures VALUES (?, ?)", list(pictures.items())
            )
            connection.execute("COMMIT")
    except (sqlite3.Error, UnicodeError, OSError) as error:
        raise MemoryFileError(f"the memory is not kept in {path.name}: {error}") from error


@contextmanager
def _opened(path: Path) -> Generator[sqlite3.Connection]:
    if not path.is_file():
        raise MemoryFileError(f"there is no memory in {path}; `ippon navigate --map` keeps one")
    try:
        # Writable where it can be: a transaction that a crash cut off is undone first.
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=rw", uri=True)) as connection:
            yield connection
    except (sqlite3.Error, UnicodeError) as error:
        # A damaged text, also that of an error which SQLite quotes, is not UTF-8.
        raise MemoryFileError(f"{path.name} is damaged or no memory file: {error}") from error


def _check_version(path: Path, connection: sqlite3.Connection) -> None:
    if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
        raise MemoryFileError(f"{path.name} is a database, but no memory file")
    version = int(connection.execute("PRAGMA user_version").fetchone()[0])
    if version not in (_WITHOUT_NOTES, VERSION):
        raise MemoryFileError(
            f"{path.name} is of version {version}; this program reads version {VERSION}"
        )


def _row_of(one: Instance) -> tuple[Any, ...]:
    return (
        one.instance_id, one.source, one.label, json.dumps(one.alternatives), one.probability,
        *one.position_world, *one.size_m, one.voxels, one.first_seen_ns, one.last_seen_ns,
        one.gone_ns, one.room, one.view_score, json.dumps(one.attributes), one.name,
        json.dumps(one.denied),
    )  # fmt: skip


def _instance_of(row: tuple[Any, ...]) -> Instance:
    number, source, label, others, p, x, y, z, sx, sy, sz, voxels, first, last, gone, *rest = row
    if source not in ("map", "search"):
        raise ValueError(f"a thing was seen by {source!r}, neither map nor search")
    return Instance(
        instance_id=int(number),
        source=source,
        label=str(label),
        alternatives=tuple((str(name), float(q)) for name, q in json.loads(others)),
        probability=float(p),
        position_world=(float(x), float(y), float(z)),
        size_m=(float(sx), float(sy), float(sz)),
        voxels=int(voxels),
        first_seen_ns=int(first),
        last_seen_ns=int(last),
        gone_ns=int(gone),
        room=str(rest[0]),
        view_score=float(rest[1]),
        attributes=tuple(str(text) for text in json.loads(rest[2])),
        name=str(rest[3]) if len(rest) > 3 else "",
        denied=tuple(str(label) for label in json.loads(rest[4])) if len(rest) > 3 else (),
    )
