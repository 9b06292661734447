"""Errors in worker processes come back to the program that started them."""

import os
import time
from functools import partial
from pathlib import Path

import pytest

from app.errors import UsageError
from app.evaluation.workers.process_workers import ProcessWorkers, WorkerDiedError
from app.evaluation.workers.worker import WorkerSetup
from ippon.evaluation.episode_generation import EpisodeGenerationConfig
from ippon.evaluation.trial import TrialConfig


class OddError(Exception):
    """An error that pickle cannot restore, such as one of an installed method."""

    def __init__(self, *, place):
        super().__init__(f"nothing at {place}")


def work(item):
    if item == 1:
        raise OddError(place="the door")
    if item == 2:
        raise ValueError("two")
    return item


def die(item, once=None):
    """Die with some numbers, and once with a file that is not there, which dies before them."""
    if isinstance(item, int):
        if item % 10 == 3:
            while once and not Path(once).exists():
                time.sleep(0.01)
            os._exit(1)
        return item
    if not Path(item).exists():
        Path(item).touch()
        os._exit(1)
    return "survived"


def _two_workers():
    setup = WorkerSetup(trial=TrialConfig(), catalogue=EpisodeGenerationConfig(), version="1")
    return ProcessWorkers(2, setup)


@pytest.fixture(scope="module")
def workers():
    """Serves all tests but one: each leaves processes that work."""
    workers = _two_workers()
    yield workers
    workers.close()


@pytest.mark.process
@pytest.mark.slow
def test_work_that_ends_its_process_does_not_end_the_others(workers, tmp_path):
    once = str(tmp_path / "once")
    found = dict(workers.each(partial(die, once=once), [0, once, 3, 4, 5]))
    assert isinstance(found.pop(3), WorkerDiedError)
    assert found == {0: 0, once: "survived", 4: 4, 5: 5}


@pytest.mark.process
@pytest.mark.slow
def test_processes_that_die_whatever_they_do_end_the_run():
    workers, found = _two_workers(), {}
    with pytest.raises(UsageError, match="killed again and again"):
        found.update(workers.each(die, [3, 13, 23, 33, 43]))
    workers._pool.shutdown()
    # Each that has died alone has its error.
    assert list(found) == [3, 13, 43, 33]


@pytest.mark.process
@pytest.mark.slow
def test_work_that_dies_first_does_not_keep_the_others_from_their_turn(workers):
    found = dict(workers.each(die, [3, 13, 23, 33, 43, 5, 4]))
    assert [found.pop(5), found.pop(4)] == [5, 4]
    assert sorted(found) == [3, 13, 23, 33, 43]
    assert all(isinstance(error, WorkerDiedError) for error in found.values())


@pytest.mark.process
@pytest.mark.slow
def test_an_error_that_cannot_be_restored_does_not_end_the_others(workers):
    found = dict(workers.each(work, range(4)))
    assert (found[0], found[3]) == (0, 3)
    assert isinstance(found[2], ValueError)
    assert "OddError: nothing at the door" in str(found[1])
