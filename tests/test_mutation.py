"""The changes that `scripts/mutation` makes."""

import ast
import importlib.util

import pytest

from tests.locations import ROOT
from tests.mutation.mutants import mutants
from tests.mutation.parts import PARTS

TARGETS = [target for part in PARTS.values() for target in part]


@pytest.mark.parametrize(
    ("source", "changed"),
    [
        ("a < b", ["a <= b", "a >= b"]),
        ("a == b", ["a != b"]),
        ("a + b", ["a - b"]),
        ("a and not b", ["a or not b", "b"]),
        ("x += 1", ["pass", "x -= 1", "2", "0"]),
        ("x.y = 0.0", ["pass", "1.0", "-1.0"]),
        ("f(True)", ["pass", "False"]),
        ("x = min(a, 2.5)", ["max(a, 2.5)", "5.0", "1.25"]),
        ("while f():\n    break", ["while not f():", "continue"]),
        ("raise ValueError('x is 1')", ["pass"]),
        ("def f(x: list[3] = 4) -> None:\n    'Five.'\n    assert x < 6", ["5", "3"]),
        ("@g(1)\ndef f(): return f'{x:.2f}'", []),
    ],
)
def test_one_place_is_changed_at_a_time(source, changed):
    found = list(mutants(source, "example"))
    assert [mutant.after for mutant in found] == changed


def test_a_mutant_is_the_module_with_that_change():
    source = "x = 2\ny = x * 3\n"
    results = []
    for mutant in mutants(source, "example"):
        names = {}
        exec(mutant.code, names)
        results.append((mutant.line, names["x"], names["y"]))
    assert results == [
        (1, 3, 9), (1, 1, 3), (2, 2, 2 / 3), (2, 2, 8), (2, 2, 4)
    ]  # fmt: skip


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.module)
def test_each_part_names_modules_and_tests_that_exist(target):
    assert importlib.util.find_spec(target.module) is not None
    assert all((ROOT / test.partition("::")[0]).exists() for test in target.tests)
    tree = ast.parse((ROOT / target.path).read_text("utf-8"))
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert target.has_kernels == bool({"njit", "INNER"} & names)
