"""What a run says where no terminal shows its bar."""

import io

from rich.console import Console

from app.cli.evaluation.run import TerminalObserver


def test_a_log_file_says_what_is_done_before_the_first_row():
    screen = Console(file=io.StringIO(), width=80)
    with TerminalObserver(screen) as observer:
        observer.begin("listing episodes", 200)
    assert screen.file.getvalue().splitlines()[0] == "listing episodes (200)"
