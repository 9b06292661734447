"""`ippon memory` on a file."""

import json
import time

import pytest

from app.cli.main import run
from app.memory.memory_file import memory_path, write_memory
from ippon.memory.instance_memory import MemoryChanges
from tests.app.memory.test_memory_file import thing


@pytest.fixture
def kept(tmp_path):
    """The map that a memory of keys, a gone mug and a chair lies beside."""
    now_ns = time.time_ns()
    things = (
        thing(1, last_seen_ns=now_ns - 300_000_000_000),
        thing(2, label="mug", gone_ns=now_ns, last_seen_ns=now_ns - 300_000_000_000),
        thing(3, label="chair", source="map", alternatives=(("stool", 0.25),), view_score=0.0),
    )
    changes = MemoryChanges(changed={one.instance_id: one for one in things})
    path = tmp_path / "home.map"
    write_memory(memory_path(path), "r", changes, {1: b"\xff\xd8jpeg"})
    return path


def test_a_table_says_what_is_where(kept, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    assert run(["memory", "--file", str(kept), "--find", "my keys"]) == 0
    out = capsys.readouterr().out
    assert "keys" in out
    assert "kitchen, at (1.0, 1.0), z = 0.5 m" in out
    assert "90%" in out
    assert "5 minutes ago" in out
    assert "remote 20%" in out
    assert "mug" not in out


def test_what_is_gone_is_said_and_is_exit_status_1(kept, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    assert run(["memory", "--file", str(memory_path(kept)), "--find", "mug"]) == 1
    assert "5 minutes ago; not there any more since just now" in capsys.readouterr().out
    assert run(["memory", "--file", str(kept), "--find", "wallet"]) == 1
    assert "nothing that answers 'wallet' is remembered" in capsys.readouterr().out


def test_json_and_a_picture(kept, capsys, tmp_path):
    picture = tmp_path / "keys.jpg"
    arguments = ["memory", "--file", str(kept), "--json", "--picture", str(picture)]
    assert run(arguments) == 0
    reply = json.loads(capsys.readouterr().out)
    assert [one["label"] for one in reply["things"]] == ["chair", "keys", "mug"] or reply["things"][
        0
    ]["label"] == "keys"
    assert reply["count"] == 3
    assert picture.read_bytes() == b"\xff\xd8jpeg"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--find", "chair", "--picture", "x.jpg"], "none of these things has a picture"),
        (["--find", "keys", "--picture", "no/such/x.jpg"], "cannot write the picture"),
        (["--find", "x" * 81], "at most 80 characters"),
        (["--limit", "0"], "from 1 to 10,000"),
        (["--find", "?"], "no object in"),
    ],
)
def test_what_cannot_be_done_is_said(kept, capsys, arguments, said):
    assert run(["memory", "--file", str(kept), *arguments]) == 2
    assert said in capsys.readouterr().err


def test_a_file_that_is_not_there_or_cut_is_said(kept, capsys, tmp_path):
    assert run(["memory", "--file", str(tmp_path / "other.map")]) == 2
    assert "there is no memory in" in capsys.readouterr().err
    path = memory_path(kept)
    path.write_bytes(path.read_bytes()[:5000])
    assert run(["memory", "--file", str(kept)]) == 2
    assert "damaged" in capsys.readouterr().err
