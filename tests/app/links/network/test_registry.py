import json
import os
import subprocess
import sys

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


def noted(entry):
    path = register(entry)
    assert path is not None
    return path


def test_nothing_runs():
    assert running_navigators() == []


def test_a_running_navigator_is_found():
    register(navigator(os.getpid()))
    assert running_navigators() == [navigator(os.getpid())]


def test_a_dead_navigator_is_forgotten():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    path = noted(navigator(child.pid))
    assert running_navigators() == []
    assert not path.exists()


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not tell")
@pytest.mark.parametrize("change", ["another process", "another start of the machine"])
def test_another_process_with_the_number_of_a_dead_navigator(change):
    """After a power cut, the numbers of processes are given again."""
    path = noted(navigator(os.getpid()))
    entry = json.loads(path.read_text())
    boot, ticks = entry["process"].split()
    now = (boot, f"{int(ticks) - 1}") if change == "another process" else ("0" + boot, ticks)
    path.write_text(json.dumps({**entry, "process": " ".join(now)}))
    assert running_navigators() == []
    assert not path.exists()


def test_a_file_of_an_earlier_version_is_read():
    path = noted(navigator(os.getpid()))
    entry = json.loads(path.read_text())
    del entry["process"]
    path.write_text(json.dumps(entry))
    assert running_navigators() == [navigator(os.getpid())]


def test_oldest_first():
    other = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        first = noted(navigator(os.getpid(), "first"))
        os.utime(first, (1.0, 1.0))
        register(navigator(other.pid, "second"))
        assert [n.robot for n in running_navigators()] == ["first", "second"]
    finally:
        other.communicate(b"\n")


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b'{"pid": 1}', b'{"pid": "x"}', b'{"pid": 1, "robot": "\xff"}', bytes(100)],
)
def test_a_damaged_file_is_skipped(content):
    path = noted(navigator(os.getpid()))
    path.with_name("7.json").write_bytes(content)
    assert len(running_navigators()) == 1


def test_others_cannot_read_the_folder():
    register(navigator(os.getpid()))
    assert registry.registry_folder().stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("folder", [None, "/nosuch/run/user/1000"])
def test_another_terminal_finds_it_whatever_its_runtime_folder_is(folder, monkeypatch):
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    register(navigator(os.getpid()))
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
