"""Levels on a terminal: as a table, or as JSON."""

import json
from collections.abc import Sequence
from typing import Protocol

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ippon.guidance.language.words import is_many
from ippon.guidance.levels import Level
from ippon.vocabulary import in_words

COLORS = {
    Level.CERTAIN: "#D55E00",
    Level.NEAR: "#E69F00",
    Level.AVERAGE: "#9AA0A6",
    Level.FAR: "#0072B2",
}


class Row(Protocol):
    """Level of one common object."""

    @property
    def label(self) -> str:
        """Name of the object."""
        ...

    @property
    def reason(self) -> str:
        """Why."""
        ...


def said_by(provider: str, elapsed_ms: float, *, from_cache: bool) -> str:
    """Return the provider of the levels and their duration."""
    took = f"{elapsed_ms:.1f} ms" if elapsed_ms < 1000.0 else f"{1e-3 * elapsed_ms:.1f} s"
    return f"{provider}, after {took}{', from the cache' if from_cache else ''}"


def print_levels(
    name: str, rated: Sequence[tuple[Level, Row]], notes: Sequence[str], source: str
) -> None:
    """Print every common object with level and reason, the nearest first."""
    console = Console()
    words = printable(name.replace("_", " "))
    title = f"Where {'are' if is_many(words) else 'is'} the {words}?"
    table = Table(title=title, title_justify="left", title_style="bold")
    for heading in ("level", "near this object", "because"):
        table.add_column(heading)
    for level, row in sorted(rated, key=lambda one: -one[0]):
        table.add_row(
            Text(f"■ {level.text}", style=COLORS[level]),
            Text(printable(in_words(row.label))),
            Text(printable(row.reason)),
        )
    console.print(table)
    for note in notes:
        console.print(Text(f"note: {printable(note)}"))
    console.print(Text(printable(source), style="dim"))


def print_question(prompt: str, reply: str) -> None:
    """Print the exact question to a language model and its answer."""
    if not prompt:
        print("no language model was asked")
        return
    print(f"\n--- question ---\n{printable(prompt)}\n--- answer ---\n{printable(reply)}")


def printable(text: str) -> str:
    """Remove control characters, so that a model's answer cannot control the terminal."""
    return "".join(char for char in text if char.isprintable() or char == "\n")


def as_json(values: dict[str, object], rated: Sequence[tuple[Level, Row]]) -> str:
    """Return JSON with levels and reasons by label, after other entries."""
    levels = {row.label: level.text for level, row in rated}
    reasons = {row.label: row.reason for _, row in rated}
    return json.dumps({**values, "levels": levels, "reasons": reasons}, ensure_ascii=False)
