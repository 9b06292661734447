"""Errors in worker processes come back to the program that started them."""

import pytest

from app.evaluation.workers.process_workers import ProcessWorkers
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


@pytest.mark.process
@pytest.mark.slow
def test_an_error_that_cannot_be_restored_does_not_end_the_others():
    setup = WorkerSetup(trial=TrialConfig(), catalogue=EpisodeGenerationConfig(), version="1")
    workers = ProcessWorkers(1, setup)
    try:
        found = dict(workers.each(work, range(4)))
    finally:
        workers.close()
    assert (found[0], found[3]) == (0, 3)
    assert isinstance(found[2], ValueError)
    assert "OddError: nothing at the door" in str(found[1])
