"""Imports at the first use: every worker reads every file of tests, and one of them runs it.

torch with transformers takes five seconds of a core, open3d one.
"""

import functools
import importlib
import importlib.util
from collections.abc import Callable
from typing import Any

import pytest


class _Later:
    """Stands for a module, or a function or class of one."""

    def __init__(self, load: Callable[[], Any]) -> None:
        self._load = functools.cache(load)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self._load()(*args, **kwargs)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            # pytest asks each name of a file whether it is a test or a mock.
            raise AttributeError(name)
        return getattr(self._load(), name)


def module(name: str) -> Any:
    """Return a module that is imported when it is first used."""
    return _Later(lambda: importlib.import_module(name))


def names(name: str, *wanted: str) -> Any:
    """Return functions or classes of a module that is imported when one of them is first used."""
    found = tuple(
        _Later(functools.partial(lambda one: getattr(importlib.import_module(name), one), one))
        for one in wanted
    )
    return found if len(found) > 1 else found[0]


def needs(*packages: str, extra: str) -> None:
    """Skip the tests of a file unless packages of an optional extra are installed."""
    for package in packages:
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"the extra ippon[{extra}] is not installed", allow_module_level=True)
