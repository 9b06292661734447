"""`ippon doctor FILE`: checks a recording, and repairs it if it was cut off."""

import json
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from app.errors import UsageError
from app.recording.errors import RecordingError
from app.recording.reading.repair import RecordingCheck, check


def run_file_doctor(path: Path, *, as_json: bool) -> int:
    """Check and repair a recording, and print what is missing."""
    try:
        checkup = check(path, repair=True)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    if as_json:
        print(json.dumps(asdict(checkup)))
    else:
        _print(path, checkup)
    return 0


def _print(path: Path, checkup: RecordingCheck) -> None:
    screen = Console(highlight=False)
    screen.print(f"[bold]{escape(str(path))}[/bold]", soft_wrap=True)
    screen.print(f"  {checkup.messages} messages, {checkup.duration_s:.1f} s")
    for problem in checkup.problems:
        screen.print(f"  [yellow]{escape(problem)}[/yellow]", soft_wrap=True)
    if checkup.repaired:
        screen.print("  [green]repaired: index, timeline and metadata.yaml were rewritten[/green]")
    elif checkup.complete and not checkup.problems:
        screen.print("  [green]whole[/green]")
    if checkup.missing:
        screen.print(f"  without: {', '.join(checkup.missing)}", soft_wrap=True)
