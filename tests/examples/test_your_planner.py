"""A planner of one's own is evaluated beside the baselines, on the same searches."""

import runpy
import sys

import pytest

from tests.locations import ROOT


@pytest.mark.slow
def test_every_method_gets_the_same_search(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["your_planner.py", "1", "15"])
    after = runpy.run_path(str(ROOT / "examples" / "your_planner.py"))
    lines = capsys.readouterr().out.splitlines()
    methods = ["ahead_first", "nearest_frontier", "ippon"]
    assert [line.split()[2].rstrip(":") for line in lines[:3]] == methods, "said as they end"
    assert [line.split()[0] for line in lines[3:]] == methods
    rows = [after["rows"][name][0] for name in methods]
    assert len({(row.episode_id, row.start_x_m, row.seed) for row in rows}) == 1
    assert rows[0].path_length_m > 0.0
