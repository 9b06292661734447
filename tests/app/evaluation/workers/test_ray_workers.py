"""`ippon eval run --ray` on a cluster of this machine."""

import dataclasses
import importlib.util

import pytest

from app.errors import UsageError
from app.evaluation.config import EvaluationConfig
from app.evaluation.results_folder import EvaluationFolder
from app.evaluation.run import run_evaluation
from app.evaluation.workers.ray_workers import RayWorkers
from app.evaluation.workers.worker import WorkerSetup
from ippon.evaluation.episode_generation import EpisodeGenerationConfig
from ippon.evaluation.row import TIMING_COLUMNS
from ippon.evaluation.trial import habitat_trial

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("ray") is None, reason='Ray is not installed: pip install "ippon[ray]"'
)
_SETUP = WorkerSetup(trial=habitat_trial(32), catalogue=EpisodeGenerationConfig(), version="test")


def half(number: int) -> int:
    """Divide by two, or die in one of two ways."""
    import os

    if number == 13:
        os._exit(1)
    if number % 2:
        raise ValueError(f"{number} is odd")
    return number // 2


@pytest.mark.process
def test_results_and_errors_come_back_and_dead_workers_are_replaced():
    workers = RayWorkers(None, 1, _SETUP)
    try:
        outcomes = dict(workers.each(half, [4, 13, 7, 8]))
    finally:
        workers.close()
    assert (outcomes[4], outcomes[8]) == (2, 4)
    assert "7 is odd" in str(outcomes[7])
    assert isinstance(outcomes[13], Exception)


@pytest.mark.process
@pytest.mark.slow
def test_a_cluster_and_a_process_of_this_machine_write_the_same_rows(room, tmp_path, observer):
    command = EvaluationConfig(
        out=tmp_path / "alone", homes=(str(room),), objects="chair,hat",
        methods="ippon,oracle", robot="zed", image_width=64, max_time_s=11.0,
    )  # fmt: skip
    on_ray = dataclasses.replace(command, out=tmp_path / "ray", ray=(), workers=2)
    assert run_evaluation(command, observer).failed == 0
    assert run_evaluation(on_ray, observer).failed == 0
    alone, ray = (
        [
            {k: v for k, v in dataclasses.asdict(row).items() if k not in TIMING_COLUMNS}
            for row in EvaluationFolder(tmp_path / name).rows()
        ]
        for name in ("alone", "ray")
    )
    assert len(alone) == 4
    assert alone == ray


def test_a_cluster_that_does_not_answer_is_named():
    with pytest.raises(UsageError, match=r"no Ray cluster answers at 127\.0\.0\.1:1.*--ray alone"):
        RayWorkers("127.0.0.1:1", None, _SETUP)
