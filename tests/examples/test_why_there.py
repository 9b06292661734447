"""The reasons of a recorded search are printed in order, and plotted over its map."""

import runpy
import sys

from tests.app.recording.conftest import write_session
from tests.locations import ROOT


def test_the_way_is_plotted_by_reason(tmp_path, monkeypatch, capsys):
    session, out = write_session(tmp_path).writer.path, tmp_path / "why.html"
    monkeypatch.setattr(sys, "argv", ["why_there.py", str(session), str(out)])
    after = runpy.run_path(str(ROOT / "examples" / "why_there.py"))
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == str(out)
    assert len(lines) == len(after["stretches"]) + 1
    ways = [len(way) for *_, way in after["stretches"]]
    assert sum(ways) >= 10
    traces = after["figure"].data
    assert traces[0].name == "map"
    assert len(traces[0].x) == len(after["walls"])
    assert all(why in out.read_text("utf-8") for why, *_ in after["stretches"])
