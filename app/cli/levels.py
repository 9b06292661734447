"""`ippon levels`: what common sense says about where an object is, without a robot."""

import json
import time

import msgspec
from rich.console import Console
from rich.table import Table
from rich.text import Text

from app.cli.errors import UsageError
from app.cli.options import Levels
from app.messages.control import SearchRequest
from ippon.guidance.levels import Guidance, Level
from ippon.guidance.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.vocabulary import LABORATORY_40, MATTERPORT_40

COLORS = {
    Level.CERTAIN: "#D55E00",
    Level.NEAR: "#E69F00",
    Level.AVERAGE: "#9AA0A6",
    Level.FAR: "#0072B2",
}


def run_levels(command: Levels) -> int:
    """Print the levels of an object."""
    check_query(command.object, command.context)
    vocabulary = MATTERPORT_40 if command.vocabulary == "matterport" else LABORATORY_40
    prior = EmbeddedPrior()
    started = time.perf_counter()
    resolved = resolve_object(command.object, vocabulary)
    guidance = prior.levels(resolved, command.context, vocabulary)
    elapsed_ms = 1e3 * (time.perf_counter() - started)
    if command.json:
        print(json.dumps(_as_dict(guidance, elapsed_ms), ensure_ascii=False))
    else:
        _print_table(guidance, elapsed_ms)
    return 0


def check_query(wanted: str, context: str) -> None:
    """Refuse an object or a context that no navigator would take.

    Raises:
        UsageError: With what would work.
    """
    if not wanted.strip():
        raise UsageError('no object given; for example: ippon ask "hat"')
    request = msgspec.json.encode({"object": wanted, "context": context})
    try:
        msgspec.json.decode(request, type=SearchRequest)
    except msgspec.ValidationError as error:
        raise UsageError(
            f"an object is at most 80 and a context at most 2000 characters; yours have "
            f"{len(wanted)} and {len(context)} ({error})"
        ) from error


def _as_dict(guidance: Guidance, elapsed_ms: float) -> dict[str, object]:
    return {
        "object": guidance.ooi,
        "context": guidance.context,
        "provider": guidance.provider,
        "elapsed_ms": round(elapsed_ms, 2),
        "levels": {row.label: row.level.name.lower() for row in guidance.rows},
        "reasons": {row.label: row.reason for row in guidance.rows},
        "notes": list(guidance.notes),
    }


def _print_table(guidance: Guidance, elapsed_ms: float) -> None:
    console = Console()
    title = guidance.ooi.replace("_", " ")
    table = Table(title=f"Where is the {title}?", title_justify="left", title_style="bold")
    table.add_column("level")
    table.add_column("near this object")
    table.add_column("because")
    for row in sorted(guidance.rows, key=lambda row: -row.level):
        table.add_row(
            Text(f"■ {row.level.name.lower()}", style=COLORS[row.level]),
            row.label.replace("_", " "),
            Text(row.reason),
        )
    console.print(table)
    for note in guidance.notes:
        console.print(Text(f"note: {note}"))
    console.print(Text(f"{guidance.provider}, {elapsed_ms:.1f} ms", style="dim"))
