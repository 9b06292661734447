"""Entry points of other packages: found, loaded, and explained where they are not."""

from importlib.metadata import EntryPoint

import pytest

from ippon import extensions
from ippon.evaluation.methods.method_table import METHODS, method_named

MINE = METHODS["ippon"]


@pytest.fixture
def installed(monkeypatch):
    points = []
    monkeypatch.setattr(
        extensions, "entry_points", lambda group: [p for p in points if p.group == group]
    )

    def add(name, value, group=extensions.METHODS):
        points.append(EntryPoint(name=name, value=value, group=group))

    return add


def test_additions_are_found_by_group_and_loaded(installed):
    installed("b", "math:pi")
    installed("a", "math:tau")
    installed("c", "math:e", extensions.SCENES)
    assert extensions.names(extensions.METHODS) == ("a", "b")
    assert extensions.load(extensions.SCENES, "c") == pytest.approx(2.718, abs=1e-3)


def test_what_is_missing_is_said_with_what_is_there(installed):
    with pytest.raises(extensions.ExtensionError, match="none is installed"):
        extensions.load(extensions.METHODS, "x")
    installed("a", "math:tau")
    with pytest.raises(extensions.ExtensionError, match=r"there are a$"):
        extensions.load(extensions.METHODS, "x")


def test_a_package_that_cannot_be_imported_is_named(installed):
    installed("a", "no_such_module:thing")
    with pytest.raises(extensions.ExtensionError, match=r"'a' of ippon.methods \(no_such_module"):
        extensions.load(extensions.METHODS, "a")


def test_a_method_that_is_none_is_refused_and_ours_come_first(installed):
    installed("pi", "math:pi")
    installed("ippon", "math:pi")
    with pytest.raises(ValueError, match="the installed method 'pi' is no Method of that name"):
        method_named("pi")
    installed("named", "tests.ippon.test_extensions:MINE")
    with pytest.raises(ValueError, match=r"'named' is no .* name: it is a Method named 'ippon'"):
        method_named("named")
    assert method_named("ippon") is METHODS["ippon"]
    with pytest.raises(ValueError, match=r"no method 'q'; there are ippon, .*, pi"):
        method_named("q")
