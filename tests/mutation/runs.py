"""Runs of a module's tests with a mutant in its place, each in a forked process."""

import contextlib
import importlib
import os
import resource
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from types import CodeType

import numba
import pytest
from hypothesis import Phase, settings

from tests.locations import ROOT
from tests.mutation.parts import Target

_STARTING_S = 10
"""Processor time that a run may take beyond twice that of the unchanged module, seconds."""
_MOST_BYTES = 8 * 2**30


class TestRuns:
    """Runs of one module's tests."""

    def __init__(self, target: Target) -> None:
        """Run the tests of the unchanged module; import what they import from outside the project.

        Raises:
            SystemExit: They fail.
        """
        self._target = target
        self._limit_s = resource.RLIM_INFINITY
        reader, writer = os.pipe()
        child = os.fork()
        if not child:
            failed = self._run(None)
            with os.fdopen(writer, "w") as file:
                file.write("\n".join(sys.modules))
            os._exit(failed)
        os.close(writer)
        with os.fdopen(reader) as file:
            imported = file.read().split("\n")
        _, status, usage = os.wait4(child, 0)
        if status != 0:
            raise SystemExit(f"these tests fail as they are: {' '.join(target.tests)}")
        self._limit_s = _STARTING_S + round(2.0 * (usage.ru_utime + usage.ru_stime))
        for name in imported:
            if name.partition(".")[0] not in ("ippon", "app", "tests"):
                # Modules that extensions make have no file to be imported from.
                with contextlib.suppress(ImportError):
                    importlib.import_module(name)

    def fail_with(self, code: CodeType) -> bool:
        """Tell whether the tests fail, or do not end, with a mutant."""
        child = os.fork()
        if not child:
            os._exit(self._run(code))
        return os.waitpid(child, 0)[1] != 0

    def _run(self, code: CodeType | None) -> int:
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, 1)
        os.dup2(sink, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (self._limit_s, self._limit_s))
        if code is not None:
            resource.setrlimit(resource.RLIMIT_AS, (_MOST_BYTES, _MOST_BYTES))
            sys.meta_path.insert(0, _Changed(self._target, code))
        if self._target.has_kernels:
            os.environ["NUMBA_DISABLE_JIT"] = "1"
            numba.config.reload_config()
        # One failing example is enough: looking for a smaller one takes longer than all else.
        phases = (Phase.explicit, Phase.generate)
        settings.register_profile("mutation", derandomize=True, database=None, phases=phases)
        options = ["-x", "-q", "-p", "no:xdist", "-o", "timeout=60", "--assert=plain"]
        # Sums of bytes overflow in numpy alone: compiled, they are wider.
        options += ["--hypothesis-profile=mutation", "-W", "ignore::RuntimeWarning"]
        return int(pytest.main([*options, *self._target.tests]))


class _Changed(SourceFileLoader, MetaPathFinder):
    """Imports one module from a mutant's code."""

    def __init__(self, target: Target, code: CodeType) -> None:
        super().__init__(target.module, str(ROOT / target.path))
        self._code = code

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        if fullname != self.name:
            return None
        return spec_from_file_location(fullname, self.path, loader=self)

    def get_code(self, fullname: str) -> CodeType:
        return self._code
