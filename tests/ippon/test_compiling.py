"""For which processor kernels are compiled. The second process: `mapping/test_warm_up.py`."""

from types import SimpleNamespace

import pytest
from llvmlite import binding

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
