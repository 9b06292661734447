"""A Ray cluster that is not there; `scenarios/test_same_rows.py` runs an evaluation on one."""

import importlib.util

import pytest

from app.errors import UsageError
from app.evaluation.workers.ray_workers import RayWorkers
from app.evaluation.workers.worker import WorkerSetup
from ippon.evaluation.episode_generation import EpisodeGenerationConfig
from ippon.evaluation.trial import habitat_trial

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("ray") is None, reason='Ray is not installed: pip install "ippon[ray]"'
)
_SETUP = WorkerSetup(trial=habitat_trial(32), catalogue=EpisodeGenerationConfig(), version="test")


def test_a_cluster_that_does_not_answer_is_named():
    with pytest.raises(UsageError, match=r"no Ray cluster answers at 127\.0\.0\.1:1.*--ray alone"):
        RayWorkers("127.0.0.1:1", None, _SETUP)
