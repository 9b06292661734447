import sqlite3
import subprocess
import sys
import time
from contextlib import closing

import pytest

from app.errors import MemoryFileError
from app.memory.memory_file import (
    VERSION,
    memory_path,
    read_memory,
    read_picture,
    write_memory,
)
from ippon.memory.instance import Instance
from ippon.memory.instance_memory import MemoryChanges


def thing(k=1, **fields):
    defaults = {
        "source": "search",
        "label": "keys",
        "alternatives": (("remote", 0.2),),
        "probability": 0.9,
        "position_world": (1.0, float(k), 0.5),
        "size_m": (0.1, 0.2, 0.3),
        "voxels": 4,
        "first_seen_ns": 1_700_000_000_000_000_001,
        "last_seen_ns": 1_700_000_000_000_000_002,
        "room": "kitchen",
        "view_score": 0.25,
    }
    return Instance(instance_id=k, **(defaults | fields))


def changes(*things, removed=()):
    return MemoryChanges(changed={one.instance_id: one for one in things}, removed=set(removed))


@pytest.fixture
def path(tmp_path):
    path = memory_path(tmp_path / "home.map")
    assert path.name == "home.map.memory"
    write_memory(path, "r", changes(thing(1), thing(2, gone_ns=7)), {1: b"\xff\xd8one"})
    return path


def test_what_was_written_is_read_to_the_nanosecond(path):
    assert read_memory(path, "r") == (thing(1), thing(2, gone_ns=7))
    assert read_memory(path) == read_memory(path, "r")
    assert read_picture(path, 1) == b"\xff\xd8one"
    assert read_picture(path, 2) is None


@pytest.mark.parametrize("text", [b"tablepictures", b"probability"])
def test_texts_that_are_no_utf_8_are_told_as_damage(path, text):
    path.write_bytes(path.read_bytes().replace(text, b"\xff" + text[1:], 1))
    with pytest.raises(MemoryFileError, match="damaged"):
        read_memory(path, "r")


CRASH = """
import os, sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
connection.execute("PRAGMA cache_size = 2")
connection.execute("BEGIN IMMEDIATE")
for k in range(100):
    connection.execute("INSERT OR REPLACE INTO pictures VALUES (?, ?)", (k, bytes(20_000)))
os._exit(1)
"""


def test_a_write_that_a_crash_cut_off_is_undone(path):
    subprocess.run([sys.executable, "-c", CRASH, str(path)], check=False)
    assert path.with_name(f"{path.name}-journal").stat().st_size > 0
    assert read_memory(path, "r") == (thing(1), thing(2, gone_ns=7))
    assert read_picture(path, 1) == b"\xff\xd8one"


def test_changes_replace_and_remove(path):
    write_memory(path, "r", changes(thing(2, label="mug"), thing(3), removed=[1]), {3: b"new"})
    assert [(one.instance_id, one.label) for one in read_memory(path)] == [(2, "mug"), (3, "keys")]
    assert read_picture(path, 1) is None
    assert read_picture(path, 3) == b"new"


def test_ten_thousand_things_are_read_and_written(tmp_path):
    path = tmp_path / "large.memory"
    everything = tuple(thing(k) for k in range(1, 10_001))
    started = time.perf_counter()
    write_memory(path, "r", changes(*everything), dict.fromkeys(range(1, 2001), b"x" * 3000))
    assert read_memory(path) == everything
    assert time.perf_counter() - started < 60.0, "seconds, not minutes"


def test_a_file_that_is_not_there_says_what_makes_one(tmp_path):
    with pytest.raises(MemoryFileError, match="`ippon navigate --map` keeps one"):
        read_memory(tmp_path / "none.memory")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9])
def test_a_file_that_was_cut_is_refused(path, share):
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(MemoryFileError, match=r"home\.map\.memory is (damaged|a database)"):
        read_memory(path)


def test_a_file_with_a_damaged_page_is_refused(path):
    content = bytearray(path.read_bytes())
    content[4096:8192] = b"\x5a" * 4096
    path.write_bytes(content)
    with pytest.raises(MemoryFileError, match="damaged"):
        read_memory(path)


def test_another_file_is_no_memory(tmp_path):
    path = tmp_path / "notes.memory"
    path.write_text("Buy milk. " * 200)
    with pytest.raises(MemoryFileError, match="damaged or no memory file"):
        read_memory(path)
    with closing(sqlite3.connect(tmp_path / "other.memory")) as other:
        other.execute("CREATE TABLE instances (id)")
        other.commit()
    with pytest.raises(MemoryFileError, match="a database, but no memory file"):
        read_memory(tmp_path / "other.memory")


def test_another_version_and_another_robot_are_refused(path):
    with pytest.raises(MemoryFileError, match="the memory of robot 'r'; this one is 'scout'"):
        read_memory(path, "scout")
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(f"PRAGMA user_version = {VERSION + 1}")
    with pytest.raises(MemoryFileError, match=r"is of version 4; this program reads version 3"):
        read_memory(path)


def test_rows_that_mean_nothing_are_damage(path):
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("UPDATE instances SET alternatives = '[1' WHERE id = 2")
        connection.commit()
    with pytest.raises(MemoryFileError, match=r"home\.map\.memory is damaged"):
        read_memory(path)
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("UPDATE instances SET alternatives = '[]', source = 'dream'")
        connection.commit()
    with pytest.raises(MemoryFileError, match="seen by 'dream'"):
        read_memory(path)


def test_a_failed_write_leaves_the_file_as_it_was(path):
    broken = thing(3, source=None)
    with pytest.raises(MemoryFileError, match="is not kept in"):
        write_memory(path, "r", changes(thing(1, label="mug"), broken), {})
    assert read_memory(path) == (thing(1), thing(2, gone_ns=7))
    with pytest.raises(MemoryFileError, match="is not kept in"):
        write_memory(path.parent / "none" / "x.memory", "r", changes(thing(1)), {})


def test_what_people_say_is_kept_and_a_file_from_before_is_read_and_completed(path):
    with closing(sqlite3.connect(path)) as connection:
        for column in ("name", "denied"):
            connection.execute(f"ALTER TABLE instances DROP COLUMN {column}")
        connection.execute("PRAGMA user_version = 2")
        connection.commit()
    assert read_memory(path, "r") == (thing(1), thing(2, gone_ns=7))
    noted = thing(2, name="Anna's keys", denied=("remote", "keys"))
    write_memory(path, "r", changes(noted), {})
    assert read_memory(path, "r") == (thing(1), noted)
