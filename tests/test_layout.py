"""The shape of the tree: tests beside what they test, small folders, short modules and functions.

A folder `scenarios` holds the tests of what several modules of its folder do together.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.locations import ROOT

MODULES_IN_A_FOLDER = 14
LINES_OF_A_MODULE = 350
LINES_OF_A_FUNCTION = 60
LINES_OF_A_KERNEL = 120
SCENARIOS = "scenarios"

LARGE_FOLDERS: set[str] = set()
"""Folders that may hold more modules; one that no longer does fails the test, too."""
LONG_MODULES: set[str] = set()
"""Modules that may be longer; likewise exact."""
LONG_FUNCTIONS: set[str] = {
    "ippon/evaluation/episode_record.py:search",
    "ippon/evaluation/trial.py:_row",
    "ippon/mapping/objects/bayes_update.py:update_by_images",
    "ippon/mapping/objects/bayes_update.py:update_by_places",
}
"""Functions that may be longer, as `module:function`; likewise exact."""


def modules_of(folder: str) -> list[Path]:
    return sorted(p.relative_to(ROOT) for p in (ROOT / folder).rglob("*.py"))


@pytest.mark.parametrize("source", ["ippon", "app"])
def test_a_test_lies_where_its_module_does(source):
    tests = [p for p in modules_of(f"tests/{source}") if p.name.startswith("test_")]
    assert tests
    astray = []
    for test in tests:
        folder = ROOT / test.relative_to("tests").parent
        module = folder / test.name.removeprefix("test_")
        if folder.name == SCENARIOS:
            found = (folder.parent / "__init__.py").exists()
        else:
            found = module.exists() or (module.with_suffix("") / "__init__.py").exists()
        if not found:
            astray.append(test.as_posix())
    assert astray == []


def test_a_folder_holds_a_dozen_modules_or_so():
    count: dict[str, int] = {}
    for source in ("ippon", "app", "tests/ippon", "tests/app"):
        for path in modules_of(source):
            if path.name != "__init__.py":
                folder = path.parent.as_posix()
                count[folder] = count.get(folder, 0) + 1
    assert {folder for folder, n in count.items() if n > MODULES_IN_A_FOLDER} == LARGE_FOLDERS


def test_modules_are_short():
    found = {
        path.as_posix()
        for source in ("ippon", "app")
        for path in modules_of(source)
        if (ROOT / path).read_text(encoding="utf-8").count("\n") > LINES_OF_A_MODULE
    }
    assert found == LONG_MODULES


@pytest.mark.slow
def test_functions_are_short():
    found = {
        f"{path.as_posix()}:{name}"
        for source in ("ippon", "app")
        for path in modules_of(source)
        for name in long_functions(ast.parse((ROOT / path).read_text(encoding="utf-8")))
    }
    assert found == LONG_FUNCTIONS


def long_functions(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            assert node.end_lineno is not None
            is_kernel = any("njit" in ast.unparse(d) for d in node.decorator_list)
            limit = LINES_OF_A_KERNEL if is_kernel else LINES_OF_A_FUNCTION
            if node.end_lineno - node.lineno + 1 > limit:
                yield node.name
