"""Examples with options explain them, and say what is missing."""

import runpy
import sys

import pytest

from tests.locations import ROOT

WITH_OPTIONS = sorted(
    path.name
    for path in (ROOT / "examples").glob("*.py")
    if path.name != "map_and_ask.py"  # It has none.
)


@pytest.mark.parametrize("name", WITH_OPTIONS)
def test_help_is_printed(name, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [name, "--help"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(ROOT / "examples" / name))
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: {name} [-h]")


@pytest.mark.parametrize("name", [name for name in WITH_OPTIONS if name != "your_planner.py"])
def test_a_missing_argument_is_named(name, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [name])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(ROOT / "examples" / name))
    assert ended.value.code == 2
    assert "the following arguments are required: " in capsys.readouterr().err
