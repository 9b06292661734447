"""Measures over the episodes of habitat's data set."""

from types import SimpleNamespace

from app.evaluation.habitat_episodes import MEASURES, mean_measures, run_episodes


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
