"""One evaluation by one process, by several and on a Ray cluster: the rows are the same."""

import dataclasses
import importlib.util
import json

import pytest

from app.evaluation import run
from app.evaluation.config import EvaluationConfig
from app.evaluation.results_folder import TABLE_FILE, EvaluationFolder
from app.evaluation.workers.ray_workers import RayWorkers
from ippon.evaluation.row import TIMING_COLUMNS
from ippon.simulation.scene_writer import save_scene
from tests.app.conftest import room_scene
from tests.app.evaluation.conftest import Told

pytestmark = [pytest.mark.process, pytest.mark.slow]


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """An evaluation by one worker: its configuration, with the results in `out`."""
    folder = tmp_path_factory.mktemp("alone")
    save_scene(room_scene(), folder / "room")
    config = EvaluationConfig(
        out=folder / "out", homes=(str(folder / "room"),), objects="chair,hat",
        methods="oracle,ippon", robot="zed", image_width=64, max_time_s=8.0, workers=1,
    )  # fmt: skip
    assert run.run_evaluation(config, Told()).failed == 0
    return config


def rows(out):
    # A commit between two runs changes the version and nothing else.
    left_out = {*TIMING_COLUMNS, "version"}
    return [
        {k: v for k, v in dataclasses.asdict(row).items() if k not in left_out}
        for row in EvaluationFolder(out).rows()
    ]


def half(number: int) -> int:
    """Divide by two, or die in one of two ways."""
    import os

    if number == 13:
        os._exit(1)
    if number % 2:
        raise ValueError(f"{number} is odd")
    return number // 2


def test_one_worker_and_two_write_the_same_rows(alone, tmp_path, observer):
    both = dataclasses.replace(alone, out=tmp_path / "two", workers=2)
    assert run.run_evaluation(both, observer).failed == 0
    one = rows(alone.out)
    assert one == rows(both.out)
    oracle, ippon = ([r for r in one if r["method"] == name] for name in ("oracle", "ippon"))
    assert len(oracle) == len(ippon) == 2
    assert all(row["success"] for row in oracle)
    assert (alone.out / TABLE_FILE).is_file()


@pytest.mark.skipif(
    importlib.util.find_spec("ray") is None, reason='Ray is not installed: pip install "ippon[ray]"'
)
def test_a_cluster_writes_the_rows_of_this_machine_and_replaces_dead_workers(
    alone, tmp_path, observer, monkeypatch
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
    on_ray = dataclasses.replace(alone, out=tmp_path / "ray", ray=(), workers=2)
    assert run.run_evaluation(on_ray, observer).failed == 0
    assert len(rows(alone.out)) == 4
    assert rows(alone.out) == rows(on_ray.out)
    version = json.loads((on_ray.out / "run.json").read_text())["version"]
    assert {row.version for row in EvaluationFolder(on_ray.out).rows()} == {version}
    assert (outcomes[4], outcomes[8]) == (2, 4)
    assert "7 is odd" in str(outcomes[7])
    assert isinstance(outcomes[13], Exception)
    listing, searching, asking = actors
    assert len(listing) == 1
    assert len(searching) == 2
    assert listing < searching, "who listed the home searches it, too"
    assert len(asking) == 2
    assert len(searching & asking) == 1, "the other has died and was replaced"
