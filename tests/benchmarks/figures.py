"""`scripts/benchmark all`: every figure of the documents, and which of them have moved.

A part runs several times, each in a process of its own; a figure is the median, and its noise is
the range from the smallest to the largest. It has moved if that range and the kept one have no
value in common.
"""

import json
import platform
import statistics
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from tests.locations import ROOT

TIMES: Final = (
    "guidance",
    "map",
    "planner",
    "console",
    "fleet",
    "session",
    "detector",
    "kitchen",
    "tracking",
)
"""Parts that take minutes."""
SEARCHES: Final = ("levels", "exploring", "tour", "second-day")
"""Parts that take hours: their rows are means over simulated searches, the same in every run."""
OPTIONS: Final = {"console": ("--quick",)}
"""Of some parts: an hour of messages says what five minutes say."""
KEPT: Final = ROOT / "docs/figures.json"
PAGE: Final = ROOT / "docs/figures.md"


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One row of a part, over several runs."""

    part: str
    name: str
    data: str
    unit: str
    runs: int
    median: float
    low: float
    high: float
    note: str | None = None
    """What else the last run measured."""

    @property
    def key(self) -> tuple[str, ...]:
        """What tells it from all others, whatever the runs measure; one row may have a time and
        a size."""
        return self.part, self.name, self.data, self.unit

    def has_moved(self, kept: "Figure") -> bool:
        """Return whether its range and the kept one have no value in common."""
        return self.low > kept.high or self.high < kept.low


def run_part(part: str) -> list[dict[str, Any]]:
    """Run one part in a process of its own and return its rows.

    Raises:
        subprocess.CalledProcessError: It failed; its messages were shown.
    """
    command = [sys.executable, "-m", "tests.benchmarks", *_arguments(part), "--json"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def _arguments(part: str) -> tuple[str, ...]:
    return (part, *OPTIONS.get(part, ()))


def figures_of(part: str, runs: Sequence[Sequence[dict[str, Any]]]) -> list[Figure]:
    """Return the figures of a part, in the order of its rows."""
    values: dict[tuple[str, str, str], list[float]] = {}
    notes: dict[tuple[str, str, str], str | None] = {}
    for rows in runs:
        for row in rows:
            for name, unit, value in _values(row):
                key = name, _data(row), unit
                values.setdefault(key, []).append(value)
                notes[key] = row.get("note")
    return [
        Figure(
            part=part, name=name, data=data, unit=unit, runs=len(found),
            median=statistics.median(found), low=min(found), high=max(found),
            note=notes[name, data, unit],
        )
        for (name, data, unit), found in values.items()
    ]  # fmt: skip


def _values(row: dict[str, Any]) -> Iterable[tuple[str, str, float]]:
    if row.get("median_ms") is not None:
        yield row["name"], "ms", row["median_ms"]
    if row.get("value") is not None:
        yield row["name"], row.get("unit") or "", row["value"]
    if row.get("ratio") is not None:
        yield f"{row['name']}, {row['peer']} relative to it", "times", row["ratio"]


def _data(row: dict[str, Any]) -> str:
    size = row.get("voxel_size_m")
    return row["data"] if size is None else f"{row['data']}, {100 * size:g} cm"


def regenerate(
    parts: Sequence[str],
    runs: int,
    say: Callable[[str], object],
    run: Callable[[str], list[dict[str, Any]]] = run_part,
) -> list[str]:
    """Measure parts, write their figures over the kept ones, and return which have moved.

    Each part is written as soon as it is measured, so that an end in between loses one part.

    Args:
        parts: Names of benchmarks.
        runs: How often each is run.
        say: Called with the progress.
        run: Runs a part once.
    """
    moved: list[str] = []
    for part in parts:
        rows: list[list[dict[str, Any]]] = []
        for n in range(runs):
            say(f"{part}, run {n + 1} of {runs}")
            rows.append(run(part))
        kept = read_kept()
        before = {figure.key: figure for figure in kept}
        measured = figures_of(part, rows)
        moved += [_change(before[f.key], f) for f in measured if _moved(f, before)]
        write_kept([*(f for f in kept if f.part != part), *measured])
    return moved


def _moved(figure: Figure, before: dict[tuple[str, ...], Figure]) -> bool:
    return figure.key in before and figure.has_moved(before[figure.key])


def _change(before: Figure, now: Figure) -> str:
    where = f"{now.part}: {now.name} ({now.data})"
    return f"{where}: {_text(before)} before, {_text(now)} now, {now.unit}".rstrip(", ")


def _text(figure: Figure) -> str:
    if figure.low == figure.high:
        return f"{figure.median:.4g}"
    return f"{figure.median:.4g} ({figure.low:.4g} to {figure.high:.4g})"


def _shown(figure: Figure) -> str:
    shown = f"{_text(figure)} {figure.unit}"
    return f"{shown.rstrip()}; {figure.note}" if figure.note else shown


def read_kept() -> list[Figure]:
    """Return the kept figures; none if there is no file."""
    if not KEPT.exists():
        return []
    return [Figure(**entry) for entry in json.loads(KEPT.read_text())]


def write_kept(figures: Sequence[Figure]) -> None:
    """Write the kept figures, and the page that shows them."""
    order = {part: n for n, part in enumerate((*TIMES, *SEARCHES))}
    # Parts that are measured by name only come last.
    ordered = sorted(figures, key=lambda figure: order.get(figure.part, len(order)))
    lines = ",\n".join(_line(figure) for figure in ordered)
    KEPT.write_text(f"[\n{lines}\n]\n")
    PAGE.write_text(_page(ordered))


def _line(figure: Figure) -> str:
    entry = {name: value for name, value in asdict(figure).items() if value is not None}
    return json.dumps(entry, ensure_ascii=False)


def _page(figures: Sequence[Figure]) -> str:
    lines = [
        "# Figures",
        "",
        (
            "Written by `scripts/benchmark all`, which says what has moved; what they mean stands "
            "in [results](results.md). Median of several runs, one core, smallest and largest in "
            f"parentheses. Last written on {_machine()}."
        ),
    ]
    for part in dict.fromkeys(figure.part for figure in figures):
        lines += [
            "",
            f"## `scripts/benchmark {' '.join(_arguments(part))}`",
            "",
            "| what | data | figure | runs |",
        ]
        lines += ["| --- | --- | --- | --- |"]
        lines += [
            f"| {f.name} | {f.data} | {_shown(f)} | {f.runs} |" for f in figures if f.part == part
        ]
    return "\n".join(lines) + "\n"


def _machine() -> str:
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = (n for n in cpuinfo.read_text().splitlines() if n.startswith("model name"))
        model = next(names, f":{model}").partition(":")[2].strip()
    return f"{model}, Python {platform.python_version()}"
