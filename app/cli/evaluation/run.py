"""`ippon eval run`: runs an evaluation and shows its progress."""

import sys
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, TaskID

from app.cli.config_file import beyond_flags, read_config
from app.cli.evaluation.progress import progress_bar
from app.cli.options.evaluation import EvalRun
from app.evaluation.run import run_evaluation

EXIT_FAILED = 1


def run_eval_run(command: EvalRun) -> int:
    """Run the evaluation; exit status 1 when an episode failed with an error."""
    screen = Console(file=sys.stderr)
    tree = read_config(command.config)
    unused = sorted(set(tree) - {"mission"})
    if unused:
        screen.print(f"an evaluation takes only mission from the file, not {', '.join(unused)}")
    changes = beyond_flags(EvalRun, tree).get("mission", {})
    try:
        with TerminalObserver(screen) as observer:
            result = run_evaluation(command, observer, changes)
    except KeyboardInterrupt:
        screen.print(f"interrupted; to continue, start again with --out {command.out}")
        raise
    screen.print(f"{result.rows} rows in {command.out}; see `ippon eval report {command.out}`")
    return EXIT_FAILED if result.failed else 0


class TerminalObserver:
    """Shows a progress bar for each stage; without a terminal, a line for it and each episode."""

    def __init__(self, screen: Console) -> None:
        self._screen = screen
        self._bar: Progress | None = None
        self._task = TaskID(0)
        self._done = self._total = 0

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the bar."""
        self._stop()

    def begin(self, stage: str, total: int) -> None:
        """Show a new bar; see `EvaluationObserver.begin`."""
        self._stop()
        self._done, self._total = 0, total
        if not self._screen.is_terminal:
            self._screen.print(f"{stage} ({total})", highlight=False)
            return
        self._bar = progress_bar(self._screen)
        self._task = self._bar.add_task(stage, total=total, last="")
        self._bar.start()

    def advance(self, result: str = "") -> None:
        """Advance the bar; see `EvaluationObserver.advance`."""
        self._done += 1
        if self._bar is not None:
            self._bar.update(self._task, advance=1, last=escape(result))
        elif result and not self._screen.is_terminal:
            line = f"{self._done}/{self._total} {result}"
            self._screen.print(line, soft_wrap=True, highlight=False, markup=False)

    def tell(self, text: str, *, error: bool = False) -> None:
        """Print a line; see `EvaluationObserver.tell`."""
        self._stop()
        self._screen.print(escape(text), style="red" if error else None, soft_wrap=True)

    def _stop(self) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar = None
