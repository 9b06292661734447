"""What all tests share; threads and numba's cache are set before any test module is imported."""

import atexit
import functools
import gc
import os
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import settings
from xdist.remote import Producer
from xdist.scheduler import LoadFileScheduling
from xdist.workermanage import WorkerController

from app.process.environment import prevent_spinning
from app.process.kernel_cache import use_kernel_cache

prevent_spinning()
use_kernel_cache()
# The first example may wait for a kernel, and any for the other workers. All runs try the same
# examples; others are drawn with --hypothesis-profile random.
settings.register_profile("patient", deadline=None, derandomize=True)
settings.register_profile("random", deadline=None, max_examples=500)
settings.load_profile("patient")


_LONG = {"process", "browser", "slow"}
_REPEATED = {"process", "browser"}
_PAGES = ("tests/product/", "_page.py")
_NEEDS_TORCH = ('later.needs("torch"', "\n    import torch\n")
_FOR_PROCESSES = 2
"""Number of workers that begin with files that start processes or browsers."""


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Search for garbage among what the tests make, not among imported modules and tests.

    Going through those again and again took 5 % of each worker's processor time.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        atexit.register(gc.unfreeze)
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run files with a browser first, then other long ones; repeat what needs processes once.

    Workers take one file after the other: what is left for the end should be short.

    Tests of processes share two cores with one another. A dead-man's switch or a lease that ends
    because a page had no processor time for seconds is right, and not what the test is about. The
    report lists each repetition.
    """
    browser, long = set(), set()
    for item in items:
        marks = {mark.name for mark in item.iter_markers()}
        if "browser" in marks:
            browser.add(item.path)
        if not _LONG.isdisjoint(marks):
            long.add(item.path)
        if not _REPEATED.isdisjoint(marks):
            item.add_marker(pytest.mark.flaky(reruns=1))
    items.sort(key=lambda item: (item.path not in browser, item.path not in long))
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker and long and not _is_for_processes(worker):
        # Tests of processes have time limits of their own.
        os.nice(5)


class _TwoKindsOfWorkers(LoadFileScheduling):
    """Gives files with processes or browsers to the first workers, others to the others first.

    What waits for processes and what computes then run side by side from beginning to end. All
    files that draw a scene are one piece of work: a page without a GPU uses a core to draw, and two
    at once leave nothing for what they show. So are all that need torch, whose import takes a
    process four seconds of a core.
    """

    def _split_scope(self, nodeid: str) -> str:
        file = super()._split_scope(nodeid)
        if any(part in file for part in _PAGES):
            return "pages"
        needs_torch = any(part in _text(file) for part in _NEEDS_TORCH)
        return "networks" if needs_torch else file

    def _assign_work_unit(self, node: WorkerController) -> None:
        wanted = _is_for_processes(node.gateway.id)
        kind = (scope for scope in self.workqueue if _starts_processes(scope) == wanted)
        self.workqueue.move_to_end(next(kind, next(iter(self.workqueue))), last=False)
        super()._assign_work_unit(node)


@functools.cache
def _starts_processes(scope: str) -> bool:
    if scope in ("pages", "networks"):
        return scope == "pages"
    return any(f"mark.{mark}" in _text(scope) for mark in _REPEATED)


@functools.cache
def _text(file: str) -> str:
    return (Path(__file__).parents[1] / file).read_text(encoding="utf-8")


def _is_for_processes(worker: str) -> bool:
    return int(worker.removeprefix("gw")) < _FOR_PROCESSES


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer | None) -> LoadFileScheduling:
    return _TwoKindsOfWorkers(config, log)
