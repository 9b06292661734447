"""`ippon eval run --ray` on a cluster of this machine."""

import dataclasses
import importlib.util

import pytest

from app.errors import UsageError
from app.evaluation import run
from app.evaluation.config import EvaluationConfig
from app.evaluation.results_folder import EvaluationFolder
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
@pytest.mark.slow
def test_a_cluster_writes_the_rows_of_this_machine_and_replaces_dead_workers(
    room, tmp_path, observer, monkeypatch
):
    """In one cluster: it takes longer to start than all else."""
    outcomes, actors = {}, []

    class Asked(RayWorkers):
        """Is asked for more once the evaluation has its rows."""

        def each(self, work, items):
            yield from super().each(work, items)
            actors.append(set(self._idle))

        def close(self):
            self._count = 1
            outcomes.update(self.each(half, [4, 13, 7, 8]))
            super().close()

    monkeypatch.setattr(run, "RayWorkers", Asked)
    command = EvaluationConfig(
        out=tmp_path / "alone", homes=(str(room),), objects="chair,hat",
        methods="ippon,oracle", robot="zed", image_width=64, max_time_s=11.0,
    )  # fmt: skip
    on_ray = dataclasses.replace(command, out=tmp_path / "ray", ray=(), workers=2)
    assert run.run_evaluation(command, observer).failed == 0
    assert run.run_evaluation(on_ray, observer).failed == 0
    alone, ray = (
        [
            {k: v for k, v in dataclasses.asdict(row).items() if k not in TIMING_COLUMNS}
            for row in EvaluationFolder(tmp_path / name).rows()
        ]
        for name in ("alone", "ray")
    )
    assert len(alone) == 4
    assert alone == ray
    assert (outcomes[4], outcomes[8]) == (2, 4)
    assert "7 is odd" in str(outcomes[7])
    assert isinstance(outcomes[13], Exception)
    listing, searching, asking = actors
    assert len(listing) == 1
    assert len(searching) == 2
    assert listing < searching, "who listed the home searches it, too"
    assert len(asking) == 2
    assert len(searching & asking) == 1, "the other has died and was replaced"


def test_a_cluster_that_does_not_answer_is_named():
    with pytest.raises(UsageError, match=r"no Ray cluster answers at 127\.0\.0\.1:1.*--ray alone"):
        RayWorkers("127.0.0.1:1", None, _SETUP)
