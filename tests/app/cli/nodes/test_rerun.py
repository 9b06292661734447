"""`ippon rerun` from the command line."""

import sys

import pytest

from app.cli.main import run


def test_without_the_package_it_says_what_to_install(monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith("app.nodes.viewers.rerun")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert run(["rerun"]) == 2
    assert 'pip install "ippon[rerun]"' in capsys.readouterr().err


def test_options_that_contradict_are_refused(tmp_path, capsys):
    pytest.importorskip("rerun", reason="needs the extra rerun")
    path = str(tmp_path / "a.rrd")
    assert run(["rerun", "--save", path, "--url", "rerun+http://127.0.0.1:9876/proxy"]) == 2
    assert "--url and --save exclude each other" in capsys.readouterr().err


@pytest.mark.process
def test_the_process_writes_a_file_and_ends_with_a_signal(launch, free_endpoint, tmp_path):
    pytest.importorskip("rerun", reason="needs the extra rerun")
    path = tmp_path / "a.rrd"
    process = launch("rerun", "--connect", free_endpoint, "--robot", "r", "--save", str(path))
    process.wait_for_log("no navigator at")
    process.child.terminate()
    assert process.finish()[0] == 0
    assert path.stat().st_size > 1000
