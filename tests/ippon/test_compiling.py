"""For which processor kernels are compiled, and how they hold arrays.

The second process: `mapping/test_warm_up.py`.
"""

import sys
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from llvmlite import binding
from numpy.typing import NDArray

from ippon import compiling


class _Features(dict[str, bool]):
    def flatten(self) -> str:
        return ",".join(f"{'+' if has else '-'}{name}" for name, has in self.items())


@pytest.fixture
def config(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """numba's settings as of a new process."""
    config = SimpleNamespace(CPU_FEATURES=None, ENABLE_AVX=1)
    monkeypatch.setattr(compiling, "config", config)
    return config


def _has(monkeypatch: pytest.MonkeyPatch, **features: bool) -> None:
    monkeypatch.setattr(binding, "get_host_cpu_features", lambda: _Features(features))


def test_a_processor_with_fast_wide_vectors_gets_them(
    config: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    _has(monkeypatch, avx2=True, avx512f=True, avx512fp16=True, sse4a=False)
    compiling.use_wide_vectors()
    assert config.CPU_FEATURES == "+avx2,+avx512f,+avx512fp16,-sse4a,-prefer-256-bit"


@pytest.mark.parametrize("features", [{"avx2": True}, {"avx512f": True, "avx512fp16": False}, {}])
def test_others_are_left_to_numba(
    config: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, features: dict[str, bool]
) -> None:
    _has(monkeypatch, **features)
    compiling.use_wide_vectors()
    assert config.CPU_FEATURES is None


@pytest.mark.parametrize(("setting", "value"), [("CPU_FEATURES", "+avx2"), ("ENABLE_AVX", 0)])
def test_what_the_user_set_stays(
    config: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, setting: str, value: object
) -> None:
    _has(monkeypatch, avx512fp16=True)
    setattr(config, setting, value)
    compiling.use_wide_vectors()
    expected = value if setting == "CPU_FEATURES" else None
    assert expected == config.CPU_FEATURES


def test_a_processor_of_unknown_features(
    config: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unknown() -> None:
        raise RuntimeError("no host features")

    monkeypatch.setattr(binding, "get_host_cpu_features", unknown)
    compiling.use_wide_vectors()
    assert config.CPU_FEATURES is None


def test_a_kernel_borrows_its_arrays() -> None:
    @compiling.njit()
    def add(rows: NDArray[np.float64], other: NDArray[np.float64]) -> float:
        total = 0.0
        for n in range(rows.shape[0]):
            row = rows[n]
            total += row[0] + other[n]
        return total

    rows, other = np.ones((3, 2)), np.ones(3)
    held = sys.getrefcount(rows), sys.getrefcount(other)
    assert add(rows, other) == 6.0
    assert (sys.getrefcount(rows), sys.getrefcount(other)) == held
    (code,) = add.inspect_llvm().values()
    assert "NRT_" not in code, "numba's runtime has no part in it"


def test_a_kernel_that_makes_arrays_says_so() -> None:
    @compiling.njit(allocates=True)
    def last(n: int) -> float:
        made = np.zeros(n)
        made[-1] = 2.0
        return made[-1]

    assert last(1000) == 2.0
    with pytest.raises(numba.TypingError):
        compiling.njit()(last.py_func)(1000)
