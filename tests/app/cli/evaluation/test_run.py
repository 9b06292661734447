"""What a run says where no terminal shows its bar."""

import io

from rich.console import Console

from app.cli.evaluation.run import TerminalObserver


def test_a_log_file_says_what_is_done_before_the_first_row():
    screen = Console(file=io.StringIO(), width=80)
    with TerminalObserver(screen) as observer:
        observer.begin("listing episodes", 200)
        observer.advance()
        observer.begin("searches", 3)
        observer.advance("1.bed.0.untold.ippon: found")
        observer.advance("1.[b].0.untold.ippon: time")
        observer.tell("one home has no bed")
    assert screen.file.getvalue().splitlines() == [
        "listing episodes (200)",
        "searches (3)",
        "1/3 1.bed.0.untold.ippon: found",
        "2/3 1.[b].0.untold.ippon: time",
        "one home has no bed",
    ]
