"""Examples with options explain them, say what is missing, and import what is declared."""

import ast
import re
import runpy
import sys
import tomllib

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


def test_every_package_that_an_example_imports_is_declared():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    declared = {re.match(r"[\w-]+", one)[0] for one in project["dependencies"]}
    imported = set()
    for path in (ROOT / "examples").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(node.module)
    packages = {name.partition(".")[0] for name in imported} - sys.stdlib_module_names
    assert packages - {"app", "ippon", *declared} == set()
