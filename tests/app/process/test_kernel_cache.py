import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from app.process import kernel_cache


@pytest.fixture
def library(tmp_path: Path) -> Path:
    folder = tmp_path / "ippon"
    folder.mkdir()
    (folder / "kernel.py").write_text("from numba import njit\n")
    (folder / "constants.py").write_text("EDGE: Final = 8\n")
    (folder / "prose.py").write_text("TEXT = 'hello'\n")
    return folder


def test_a_changed_kernel_or_constant_is_another_state(library: Path) -> None:
    first = kernel_cache.state_of(library)
    assert kernel_cache.state_of(library) == first
    (library / "prose.py").write_text("TEXT = 'bye'\n")
    assert kernel_cache.state_of(library) == first
    (library / "constants.py").write_text("EDGE: Final = 16\n")
    assert kernel_cache.state_of(library) != first


@pytest.fixture
def start(
    library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[int, float], Path]:
    """Starts a state of the sources at a time, in seconds of the system's clock."""
    monkeypatch.setattr(kernel_cache, "LIBRARY", library)
    monkeypatch.setattr(kernel_cache.platformdirs, "user_cache_path", lambda _: tmp_path / "cache")

    def start(state: int, started_s: float) -> Path:
        monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
        (library / "constants.py").write_text(f"EDGE: Final = {state}\n")
        folder = kernel_cache.use_kernel_cache()
        assert folder is not None
        assert os.environ["NUMBA_CACHE_DIR"] == str(folder)
        os.utime(folder, (started_s, started_s))
        return folder

    return start


def test_each_state_has_its_folder_and_old_ones_go(
    start: Callable[[int, float], Path], tmp_path: Path
) -> None:
    folders = [start(k, k) for k in range(kernel_cache.KEPT + 4)]
    assert len(set(folders)) == len(folders)
    left = {path.name for path in (tmp_path / "cache" / "kernels").iterdir()}
    assert folders[-1].name in left
    assert len(left) == kernel_cache.KEPT + 1


def test_what_was_started_within_a_day_may_run_and_is_kept(
    start: Callable[[int, float], Path],
) -> None:
    now_s = time.time()
    ages_s = [90_000.0, 80_000.0, *[60.0] * kernel_cache.KEPT, 0.0]
    old, running, *_ = folders = [start(k, now_s - age_s) for k, age_s in enumerate(ages_s)]
    assert not old.exists()
    assert running.exists()
    assert all(folder.exists() for folder in folders[1:])


def test_a_folder_that_was_chosen_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/somewhere")
    assert kernel_cache.use_kernel_cache() is None
    assert os.environ["NUMBA_CACHE_DIR"] == "/somewhere"
