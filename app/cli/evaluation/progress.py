"""Progress bar of a long run on the terminal."""

import math

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text


class TimeLeft(ProgressColumn):
    """Remaining time at the mean rate of the whole run, because parts end rarely and in groups."""

    max_refresh = 0.5

    def render(self, task: Task) -> Text:
        """Format hours, minutes and seconds; dashes before the first part has ended."""
        left = time_left_s(task.elapsed or 0.0, task.completed, task.total or 0.0)
        if left is None:
            return Text("-:--:--", style="progress.remaining")
        minutes, seconds = divmod(math.ceil(left), 60)
        text = f"{minutes // 60}:{minutes % 60:02}:{seconds:02}"
        return Text(text, style="progress.remaining")


def time_left_s(elapsed_s: float, completed: float, total: float) -> float | None:
    """Return the remaining time at the rate so far, None before the first part has ended."""
    if completed >= total:
        return 0.0
    return None if completed <= 0.0 else elapsed_s / completed * (total - completed)


def progress_bar(screen: Console) -> Progress:
    """Return a bar whose tasks have a field `last` for the part that ended last."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeLeft(),
        TextColumn("{task.fields[last]}"),
        console=screen,
    )
