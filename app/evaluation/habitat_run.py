"""`ippon eval habitat`: the search in habitat-lab's own environment, on its own data."""

import json
import sys
import time
from collections.abc import Iterator
from typing import Any

from app.cli.options.evaluation import EvalHabitat
from app.errors import UsageError
from app.habitat.link import HabitatProcessError, RemoteEnv
from ippon.evaluation.habitat_agent import IpponAgent
from ippon.guidance.prior import EmbeddedPrior
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import SegmentationError
from ippon.segmentation.loading import load_segmenter

MEASURES = ("success", "spl", "soft_spl", "distance_to_goal")


def run_habitat(command: EvalHabitat) -> int:
    """Search every episode of habitat's data set; one JSON object a line."""
    if command.episodes is not None and command.episodes < 1:
        raise UsageError(f"--episodes is at least 1; got {command.episodes}")
    try:
        segmentation = SegmentationConfig(backend=command.segmentation)
        segmenter = load_segmenter(segmentation, command.checkpoints)
    except SegmentationError as error:
        raise UsageError(str(error)) from error
    prior = EmbeddedPrior()
    agent = IpponAgent(segmenter, lambda resolved, labels: prior.levels(resolved, "", labels))
    results: list[dict[str, Any]] = []
    try:
        with (
            RemoteEnv(command.python, str(command.config), command.overrides) as env,
            command.out.open("w", encoding="utf-8") as out,
        ):
            for result in run_episodes(env, agent, command.episodes or env.episode_count):
                results.append(result)
                print(json.dumps(result), file=out, flush=True)
                print(f"{len(results)}: {json.dumps(result)}", file=sys.stderr)
    except HabitatProcessError as error:
        raise UsageError(str(error)) from error
    means = {name: sum(r[name] for r in results) / len(results) for name in MEASURES}
    print(json.dumps({"episodes": len(results), **means}))
    return 0


def run_episodes(env: Any, agent: IpponAgent, count: int) -> Iterator[dict[str, Any]]:
    """Run episodes in a `habitat.Env`.

    Args:
        env: A `habitat.Env` or a `RemoteEnv`, with the measures of ObjectNav and the challenge's
            velocity actions.
        agent: Searches.
        count: How many.

    Yields:
        What habitat measured of each, how the search ended, and its steps and seconds.
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
            **{name: float(metrics[name]) for name in MEASURES},
            "ending": str(agent.state),
            "steps": steps,
            "wall_s": round(time.perf_counter() - began, 3),
        }
