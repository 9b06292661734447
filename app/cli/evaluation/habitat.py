"""`ippon eval habitat`: searches in habitat-lab's environment, on its data."""

import json
import sys

from app.cli.options.evaluation import EvalHabitat
from app.errors import UsageError
from app.evaluation.habitat_episodes import mean_measures, search_data_set


def run_eval_habitat(command: EvalHabitat) -> int:
    """Search the episodes of habitat's data set; one JSON object per line."""
    if command.episodes is not None and command.episodes < 1:
        raise UsageError(f"--episodes is at least 1; got {command.episodes}")
    results: list[dict[str, object]] = []
    episodes = search_data_set(
        config=command.config,
        python=command.python,
        overrides=command.overrides,
        segmentation=command.segmentation,
        checkpoints=command.checkpoints,
        count=command.episodes,
    )
    with command.out.open("w", encoding="utf-8") as out:
        for result in episodes:
            results.append(result)
            print(json.dumps(result), file=out, flush=True)
            print(f"{len(results)}: {json.dumps(result)}", file=sys.stderr)
    print(json.dumps({"episodes": len(results), **mean_measures(results)}))
    return 0
