"""`ippon eval habitat`: searches in habitat-lab's environment, on its data."""

import json
import sys
from pathlib import Path

from app.cli.options.evaluation import EvalHabitat
from app.errors import UsageError
from app.evaluation.habitat_episodes import mean_measures, search_data_set
from ippon.atomic_file import set_aside


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
    if not command.out.parent.is_dir():
        raise UsageError(f"--out: the folder {command.out.parent} does not exist")
    for result in episodes:
        _write(command.out, json.dumps(result), begin=not results)
        results.append(result)
        print(f"{len(results)}: {json.dumps(result)}", file=sys.stderr)
    if not results:
        raise UsageError("habitat's data set has no episode")
    print(json.dumps({"episodes": len(results), **mean_measures(results)}))
    return 0


def _write(path: Path, line: str, *, begin: bool) -> None:
    """Write a line; with the first an earlier file gets another name."""
    try:
        if begin and path.is_file() and path.stat().st_size > 0:
            print(f"ippon: the earlier {path} is now {set_aside(path)}", file=sys.stderr)
        with path.open("w" if begin else "a", encoding="utf-8") as out:
            out.write(f"{line}\n")
    except OSError as error:
        raise UsageError(f"cannot write to {path}: {error.strerror}") from error
