"""`ippon foxglove` from the command line."""

import json
import sys

import pytest

from app.cli.main import run
from app.cli.nodes import foxglove
from tests.app.nodes.viewers.foxglove_client import FoxgloveClient


def test_without_the_package_it_says_what_to_install(monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith("app.nodes.viewers.foxglove")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert run(["foxglove"]) == 2
    assert 'pip install "ippon[foxglove]"' in capsys.readouterr().err


def test_the_layout_is_written_whether_or_not_a_robot_is_there(tmp_path, capsys, monkeypatch):
    pytest.importorskip("foxglove", reason="needs the extra foxglove")
    asked = []
    monkeypatch.setattr(foxglove, "resolve_address", lambda *where: asked.append(where))
    path = tmp_path / "layout.json"
    assert run(["foxglove", "--layout", str(path)]) == 0
    assert "/status" in path.read_text("utf-8")
    assert json.loads(path.read_text("utf-8"))["layout"]
    assert "Import from file" in capsys.readouterr().out
    assert run(["foxglove", "--robot", "r", "--layout", str(tmp_path)]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert asked == []


def test_a_port_that_is_none_is_refused(capsys):
    pytest.importorskip("foxglove", reason="needs the extra foxglove")
    command = ["foxglove", "--connect", "tcp/127.0.0.1:1", "--robot", "r", "--port", "70000"]
    assert run(command) == 2
    assert "a port lies in 0 to 65535; got 70000" in capsys.readouterr().err


@pytest.mark.process
def test_the_process_serves_and_ends_with_a_signal(launch, free_endpoint):
    pytest.importorskip("foxglove", reason="needs the extra foxglove")
    process = launch("foxglove", "--connect", free_endpoint, "--robot", "r", "--port", "0")
    process.wait_for_log("no navigator at")
    port = int(process.log().split("ws://127.0.0.1:")[1].split()[0])
    client = FoxgloveClient(port)
    client.wait(lambda c: "/status" in c.channels)
    client.close()
    process.child.terminate()
    assert process.finish()[0] == 0
