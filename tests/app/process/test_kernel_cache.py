import os
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


def test_each_state_has_its_folder_and_old_ones_go(
    library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernel_cache, "LIBRARY", library)
    monkeypatch.setattr(kernel_cache.platformdirs, "user_cache_path", lambda _: tmp_path / "cache")
    folders = []
    for k in range(kernel_cache.KEPT + 4):
        monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
        (library / "constants.py").write_text(f"EDGE: Final = {k}\n")
        folder = kernel_cache.use_kernel_cache()
        assert folder is not None
        assert os.environ["NUMBA_CACHE_DIR"] == str(folder)
        os.utime(folder, (k, k))
        folders.append(folder)
    assert len(set(folders)) == len(folders)
    left = {path.name for path in (tmp_path / "cache" / "kernels").iterdir()}
    assert folders[-1].name in left
    assert len(left) == kernel_cache.KEPT + 1


def test_a_folder_that_was_chosen_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/somewhere")
    assert kernel_cache.use_kernel_cache() is None
    assert os.environ["NUMBA_CACHE_DIR"] == "/somewhere"
