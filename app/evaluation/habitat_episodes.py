"""Searches in habitat-lab's environment, on its data."""

import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, Literal

from app.evaluation.errors import EvaluationError
from app.habitat.link import HabitatProcessError, RemoteEnv
from ippon.evaluation.habitat_agent import IpponAgent
from ippon.guidance.prior import EmbeddedPrior
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import SegmentationError
from ippon.segmentation.loading import load_segmenter

MEASURES: Final = ("success", "spl", "soft_spl", "distance_to_goal")


def search_data_set(
    *,
    config: Path,
    python: Path,
    overrides: Sequence[str],
    segmentation: Literal["san", "clipseg", "owlv2"],
    checkpoints: Path,
    count: int | None,
) -> Iterator[dict[str, Any]]:
    """Search the episodes of habitat's data set; see `run_episodes`.

    Args:
        config: habitat-lab's YAML of the benchmark.
        python: Interpreter with habitat-sim and habitat-lab.
        overrides: Overrides of habitat's configuration.
        segmentation: Backend of the segmentation.
        checkpoints: Folder of its checkpoints.
        count: Number of episodes; None for all.

    Raises:
        EvaluationError: The network or habitat's process cannot be started, or has ended; or the
            agent cannot use what habitat sends.
    """
    try:
        segmenter = load_segmenter(SegmentationConfig(backend=segmentation), checkpoints)
    except SegmentationError as error:
        raise EvaluationError(str(error)) from error
    prior = EmbeddedPrior()
    agent = IpponAgent(segmenter, lambda resolved, labels: prior.levels(resolved, "", labels))
    try:
        with RemoteEnv(python, str(config), overrides) as env:
            # habitat begins again after its last episode.
            yield from run_episodes(env, agent, min(count or env.episode_count, env.episode_count))
    except (HabitatProcessError, SegmentationError, ValueError) as error:
        raise EvaluationError(str(error)) from error


def mean_measures(results: Sequence[dict[str, Any]]) -> dict[str, float | None]:
    """Return the means of habitat's measures over the episodes that have them; None for none."""
    values = {name: [r[name] for r in results if r[name] is not None] for name in MEASURES}
    return {name: sum(of) / len(of) if of else None for name, of in values.items()}


def _finite(value: float) -> float | None:
    """Return a measure, None for one without a value, such as the distance to a goal on an island.

    JSON has no word for infinity.
    """
    return float(value) if math.isfinite(value) else None


def run_episodes(env: Any, agent: IpponAgent, count: int) -> Iterator[dict[str, Any]]:
    """Run episodes in a `habitat.Env`.

    Args:
        env: A `habitat.Env` or a `RemoteEnv`, with the measures of ObjectNav and the challenge's
            velocity actions.
        agent: The searching agent.
        count: Number of episodes.

    Yields:
        Per episode: habitat's measures (None where not finite), the final state of the search,
        steps and seconds.
    """
    for _ in range(count):
        observations = env.reset()
        agent.reset()
        steps, began = 0, time.perf_counter()
        while not env.episode_over:
            observations = env.step(agent.act(observations))
            steps += 1
        metrics = env.get_metrics()
        yield {
            "episode_id": env.current_episode.episode_id,
            "scene": env.current_episode.scene_id,
            "goal": env.current_episode.object_category,
            **{name: _finite(metrics[name]) for name in MEASURES},
            "ending": str(agent.state),
            "steps": steps,
            "wall_s": round(time.perf_counter() - began, 3),
        }
