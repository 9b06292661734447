import io

import pytest
from rich.console import Console

from app.cli.evaluation.progress import TimeLeft, progress_bar, time_left_s


def test_time_left_at_the_pace_so_far():
    assert time_left_s(0.0, 0, 10) is None
    assert time_left_s(100.0, 2, 10) == pytest.approx(400.0)
    assert time_left_s(100.0, 10, 10) == 0.0
    assert time_left_s(0.0, 0, 0) == 0.0


def test_time_left_is_known_however_far_apart_episodes_end():
    now_s = 0.0
    progress = progress_bar(Console(file=io.StringIO()))
    progress.get_time = lambda: now_s
    task = progress.add_task("searching", total=4, last="")
    (column,) = [c for c in progress.columns if isinstance(c, TimeLeft)]

    def shown() -> str:
        return column.render(progress.tasks[0]).plain

    assert shown() == "-:--:--"
    texts = []
    for _ in range(4):
        now_s += 1000.0
        progress.update(task, advance=1, last="an episode")
        texts.append(shown())
    assert texts == ["0:50:00", "0:33:20", "0:16:40", "0:00:00"]
