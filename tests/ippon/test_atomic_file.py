"""Files that are there whole or not at all."""

import errno
import os
import stat
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from ippon.atomic_file import remove_partial_files, replace_file, set_aside


def test_an_existing_file_is_replaced(tmp_path):
    path = tmp_path / "a.json"
    for content in (b"one", b"another"):
        replace_file(path, content)
        assert path.read_bytes() == content
    assert list(tmp_path.iterdir()) == [path]


def test_has_the_permissions_that_are_asked_for(tmp_path):
    before = os.umask(0o022)
    try:
        replace_file(tmp_path / "a", b"")
        replace_file(tmp_path / "b", b"", mode=0o600)
    finally:
        os.umask(before)
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in "ab"]
    assert modes == [0o644, 0o600]


def test_a_full_disk_leaves_the_old_file_only(tmp_path, monkeypatch):
    path = tmp_path / "a"
    replace_file(path, b"one")

    def full(_):
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="no space left"):
        replace_file(path, b"another")
    assert path.read_bytes() == b"one"
    assert list(tmp_path.iterdir()) == [path]


KILLED = """
import os, sys
from pathlib import Path
from ippon.atomic_file import replace_file
os.fsync = lambda _: os.kill(os.getpid(), 9)
replace_file(Path(sys.argv[1]), b"another")
"""


def test_what_a_killed_writer_left_is_removed(tmp_path):
    path, other = tmp_path / "home.map", tmp_path / "home.map.json.7.partial"
    replace_file(path, b"one")
    other.write_bytes(b"")
    for _ in range(2):
        subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False)
    assert path.read_bytes() == b"one"
    assert len(list(tmp_path.iterdir())) == 4
    remove_partial_files(path)
    assert sorted(tmp_path.iterdir()) == [path, other]
    remove_partial_files(tmp_path / "no" / "a")


def test_a_missing_folder_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        replace_file(tmp_path / "no" / "a", b"")


def test_writers_at_the_same_time_leave_one_of_their_files_whole(tmp_path):
    path = tmp_path / "a"
    contents = [bytes([k]) * 100_000 for k in range(8)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda content: replace_file(path, content), contents * 5))
    assert path.read_bytes() in contents
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_is_set_aside_is_never_written_over(tmp_path):
    path = tmp_path / "home.map"
    kept = []
    for content in (b"first", b"second"):
        path.write_bytes(content)
        kept.append(set_aside(path))
        assert not path.exists()
    assert [one.name for one in kept] == ["home.map.aside-1", "home.map.aside-2"]
    assert [one.read_bytes() for one in kept] == [b"first", b"second"]
    with pytest.raises(OSError, match=r"home\.map"):
        set_aside(path)
