import contextlib
import errno
import os
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from app.links.network import registry
from app.links.network.registry import (
    RunningNavigator,
    register,
    resolve_address,
    running_navigators,
)


@pytest.fixture(autouse=True)
def runtime(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert registry.registry_folder().is_relative_to(tmp_path)


@pytest.fixture
def no_folder(tmp_path, monkeypatch):
    """A cache that cannot hold a folder, for root neither: it is a file."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))


def navigator(pid, robot="ippon"):
    return RunningNavigator(pid=pid, robot=robot, endpoint="tcp/127.0.0.1:7447")


@pytest.fixture
def noted():
    """Registers navigators that run until the end of the test; returns the file of each."""
    with contextlib.ExitStack() as ends:

        def register_it(navigator):
            entry = register(navigator)
            assert entry is not None
            return ends.enter_context(contextlib.closing(entry)).path

        yield register_it


@pytest.fixture
def another_process():
    """Runs code in another process; returns it once it has printed a line."""
    children = []

    def start(code):
        given = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        children.append(subprocess.Popen([sys.executable, "-c", code], **given))
        return children[-1], children[-1].stdout.readline().strip()

    yield start
    for child in children:
        child.kill()
        child.communicate()


REGISTER = """
from app.links.network.registry import RunningNavigator, register
noted = register(RunningNavigator(pid=1, robot="ippon", endpoint="tcp/127.0.0.1:7447"))
print(noted.path, flush=True)
input()
"""


def test_nothing_runs():
    assert running_navigators() == []


def test_a_running_navigator_is_found(noted):
    noted(navigator(os.getpid()))
    assert running_navigators() == [navigator(os.getpid())]


def test_one_that_ended_is_not_listed():
    entry = register(navigator(os.getpid()))
    assert entry.path.exists()
    entry.close()
    assert not entry.path.exists()
    assert running_navigators() == []


def test_a_killed_navigator_is_forgotten_whoever_has_its_number(another_process):
    """After a power cut, or in another container, its number is that of another process."""
    child, path = another_process(REGISTER)
    assert running_navigators() == [navigator(1)]
    child.kill()
    child.wait()
    assert Path(path).exists()
    assert running_navigators() == []
    assert not Path(path).exists()


def test_one_in_another_container_is_found(another_process):
    """There it may be number 1, or one that no process has here."""
    another_process(REGISTER.replace("pid=1,", "pid=99999999,"))
    another_process(REGISTER)
    assert {one.pid for one in running_navigators()} == {1, 99999999}


@pytest.fixture
def no_locks(monkeypatch):
    def flock(*_):
        raise OSError(errno.ENOLCK, "no locks available")

    monkeypatch.setattr("fcntl.flock", flock)


@pytest.mark.usefixtures("no_locks")
@pytest.mark.parametrize(("pid", "listed"), [(os.getpid(), 1), (99999999, 0)], ids=["runs", "dead"])
def test_without_locks_the_number_of_the_process_tells(noted, pid, listed):
    noted(navigator(pid))
    assert len(running_navigators()) == listed


@pytest.fixture
def noted_elsewhere(monkeypatch):
    """A navigator of another machine that shares the folder; its process has a number of here."""
    with monkeypatch.context() as there:
        there.setattr(registry, "boot_id", lambda: "that of the other machine")
        entry = register(navigator(os.getpid()))
    with contextlib.closing(entry):
        yield entry


def test_one_of_another_machine_is_not_listed_and_removed_only_once_it_is_dead(noted_elsewhere):
    assert running_navigators() == []
    assert noted_elsewhere.path.exists()
    noted_elsewhere._file.close()
    assert running_navigators() == []
    assert not noted_elsewhere.path.exists()


@pytest.mark.usefixtures("no_locks")
def test_without_locks_one_of_another_machine_stays(noted_elsewhere):
    assert running_navigators() == []
    assert noted_elsewhere.path.exists()


@pytest.mark.parametrize(("pid", "listed"), [(os.getpid(), 1), (99999999, 0)], ids=["runs", "dead"])
def test_one_of_an_earlier_version_has_no_lock(pid, listed):
    path = registry.registry_folder() / f"{pid}.json"
    path.parent.mkdir(parents=True)
    noted = {**msgspec.structs.asdict(navigator(pid)), "process": "1 2"}
    path.write_bytes(msgspec.json.encode(noted))
    assert running_navigators() == listed * [navigator(pid)]
    assert path.exists() == bool(listed)


def test_oldest_first(noted):
    first = noted(navigator(os.getpid(), "first"))
    os.utime(first, (1.0, 1.0))
    noted(navigator(os.getpid(), "second"))
    assert [n.robot for n in running_navigators()] == ["first", "second"]


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b'{"pid": 1}', b'{"pid": "x"}', b'{"pid": 1, "robot": "\xff"}', bytes(100)],
)
def test_a_damaged_file_is_skipped(noted, content):
    path = noted(navigator(os.getpid()))
    path.with_name("7.json").write_bytes(content)
    assert len(running_navigators()) == 1


def test_others_cannot_read_the_folder(noted):
    noted(navigator(os.getpid()))
    assert registry.registry_folder().stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("folder", [None, "/nosuch/run/user/1000"])
def test_another_terminal_finds_it_whatever_its_runtime_folder_is(folder, noted, monkeypatch):
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    noted(navigator(os.getpid()))
    if folder is not None:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
    assert running_navigators() == [navigator(os.getpid())]


@pytest.mark.usefixtures("no_folder")
def test_a_navigator_runs_where_it_cannot_be_noted(caplog):
    assert register(navigator(os.getpid(), "ippon/one")) is None
    assert "--connect tcp/127.0.0.1:7447 --robot ippon/one" in caplog.text
    assert running_navigators() == []


@pytest.mark.parametrize(
    ("connect", "robot", "address"),
    [
        (None, None, ("tcp/0.0.0.0:7448", "husky")),
        ("tcp/127.0.0.1:7447", None, ("tcp/127.0.0.1:7447", "ippon")),
        ("tcp/localhost:7447", None, ("tcp/localhost:7447", "ippon")),
        ("tcp/127.0.0.1:7448", None, ("tcp/127.0.0.1:7448", "husky")),
        (None, "ippon", ("tcp/127.0.0.1:7447", "ippon")),
        (None, "third", ("tcp/0.0.0.0:7448", "third")),
        ("tcp/elsewhere:7448", None, ("tcp/elsewhere:7448", "ippon")),
        ("tcp/127.0.0.1:7448", "third", ("tcp/127.0.0.1:7448", "third")),
    ],
)
def test_endpoint_and_prefix_are_those_of_one_navigator(monkeypatch, connect, robot, address):
    there = [
        RunningNavigator(pid=1, robot="ippon", endpoint="tcp/127.0.0.1:7447"),
        RunningNavigator(pid=2, robot="husky", endpoint="tcp/0.0.0.0:7448"),
    ]
    monkeypatch.setattr(registry, "running_navigators", lambda: there)
    assert resolve_address(connect, robot) == address
