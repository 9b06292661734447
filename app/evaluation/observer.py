"""Reports of a running evaluation to the program that started it."""

from typing import Protocol


class EvaluationObserver(Protocol):
    """Receives the progress of an evaluation."""

    def begin(self, stage: str, total: int) -> None:
        """A stage of `total` parts begins; the stage before it has ended."""
        ...

    def advance(self, result: str = "") -> None:
        """One part of the stage has ended; `result` is one line about it."""
        ...

    def tell(self, text: str, *, error: bool = False) -> None:
        """A line for the user."""
        ...
