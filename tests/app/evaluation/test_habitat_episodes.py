"""Measures over the episodes of habitat's data set."""

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from app.evaluation import habitat_episodes
from app.evaluation.errors import EvaluationError
from app.evaluation.habitat_episodes import (
    MEASURES,
    mean_measures,
    run_episodes,
    search_data_set,
)
from ippon.segmentation.errors import SegmentationError


class Env:
    """One step in each episode; the goal of the second cannot be reached."""

    def __init__(self):
        self.distances = iter((1.5, float("inf")))
        self.current_episode = SimpleNamespace(
            episode_id="0", scene_id="s", object_category="chair"
        )

    def reset(self):
        self.episode_over = False

    def step(self, _):
        self.episode_over = True

    def get_metrics(self):
        return dict.fromkeys(MEASURES, 0.5) | {"distance_to_goal": next(self.distances)}


def test_a_measure_that_is_infinite_is_missing_and_leaves_the_mean_of_the_others():
    agent = SimpleNamespace(reset=lambda: None, act=lambda _: None, state="exhausted")
    results = list(run_episodes(Env(), agent, 2))
    assert [one["distance_to_goal"] for one in results] == [1.5, None]
    means = mean_measures(results)
    assert (means["distance_to_goal"], means["spl"]) == (1.5, 0.5)
    assert mean_measures(results[1:])["distance_to_goal"] is None


def _search(monkeypatch, act, count):
    """Search two episodes of a data set, or so many."""
    env = Env()
    env.episode_count = 2
    agent = SimpleNamespace(reset=lambda: None, act=act, state="exhausted")
    monkeypatch.setattr(habitat_episodes, "load_segmenter", lambda *_: None)
    monkeypatch.setattr(habitat_episodes, "IpponAgent", lambda *_: agent)
    monkeypatch.setattr(habitat_episodes, "RemoteEnv", lambda *_: nullcontext(env))
    return search_data_set(
        config=Path("c"), python=Path("p"), overrides=(), segmentation="san",
        checkpoints=Path(), count=count,
    )  # fmt: skip


@pytest.mark.parametrize(("count", "searched"), [(None, 2), (1, 1), (5, 2)])
def test_no_episode_is_searched_twice(monkeypatch, count, searched):
    """habitat begins again after its last episode."""
    assert len(list(_search(monkeypatch, lambda _: None, count))) == searched


@pytest.mark.parametrize(
    "error", [ValueError("the agent needs the sensors"), SegmentationError("out of memory")]
)
def test_what_the_agent_cannot_use_ends_the_run_with_its_reason(monkeypatch, error):
    def act(_):
        raise error

    with pytest.raises(EvaluationError, match=str(error)):
        next(_search(monkeypatch, act, None))
