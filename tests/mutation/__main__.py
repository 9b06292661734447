"""`scripts/mutation PART [--limit N] [--seed K]`."""

import argparse
import random
import sys

from tests.locations import ROOT
from tests.mutation.mutants import mutants
from tests.mutation.parts import PARTS, Target
from tests.mutation.runs import TestRuns


def main() -> None:
    """Run the tests of one part against its mutants; print those that no test notices."""
    parser = argparse.ArgumentParser(
        prog="scripts/mutation",
        description="Change one place of a module at a time and run its tests: what no test "
        "notices is printed. Each change takes about a second.",
    )
    parser.add_argument("part", choices=sorted(PARTS))
    parser.add_argument("--module", help="only the modules with this in their name")
    parser.add_argument("--limit", type=int, help="number of changes of a module, drawn at random")
    parser.add_argument("--seed", type=int, default=0, help="seed of the draw")
    options = parser.parse_args()
    for target in PARTS[options.part]:
        if options.module is None or options.module in target.module:
            _report(target, options.limit, options.seed)


def _report(target: Target, limit: int | None, seed: int) -> None:
    chosen = list(mutants((ROOT / target.path).read_text("utf-8"), target.path))
    total = len(chosen)
    if limit is not None and limit < total:
        chosen = random.Random(seed).sample(chosen, limit)
        chosen.sort(key=lambda mutant: mutant.line)
    runs = TestRuns(target)
    survivors = 0
    for mutant in chosen:
        if not runs.fail_with(mutant.code):
            survivors += 1
            _write(f"{target.path}:{mutant.line}: {mutant.before}  ->  {mutant.after}")
    _write(
        f"{target.path}: {len(chosen)} of {total} mutants, {len(chosen) - survivors} killed, "
        f"{survivors} survived"
    )


def _write(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
