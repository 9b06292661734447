"""Operations on the mission, queued by any thread and run by the mission's own thread."""

import logging
import queue
from collections.abc import Callable
from concurrent.futures import Future
from typing import Final, TypeVar

from app.links.network.requests import RequestRefusedError
from ippon.mission.mission import Mission

logger = logging.getLogger(__name__)

T = TypeVar("T")
Operation = Callable[[Mission], None]
ANSWER_S: Final = 1.8
"""Default time that a request waits for an answer; a step of the mission may be under way."""


class OperationQueue:
    """First-in, first-out queue of operations; `enqueue` and `ask` are safe from any thread."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """Create an empty queue; `wake` ends the mission thread's wait for a frame."""
        self.wake = wake
        self._operations: queue.SimpleQueue[Operation] = queue.SimpleQueue()

    def enqueue(self, operation: Operation) -> None:
        """Queue an operation and wake the mission's thread."""
        self._operations.put(operation)
        self.wake()

    def run_queued(self, mission: Mission) -> None:
        """Run the queued operations in order; called by the mission's thread."""
        while True:
            try:
                operation = self._operations.get_nowait()
            except queue.Empty:
                return
            try:
                operation(mission)
            except Exception:  # One failing request must not end the navigator.
                logger.exception("a request failed")

    def ask(self, question: Callable[[Mission], T], timeout_s: float = ANSWER_S) -> T:
        """Return the answer that the mission's thread computes.

        Raises:
            RequestRefusedError: The question raised `ValueError`, or no answer came in time.
        """
        answer: Future[T] = Future()

        def run(mission: Mission) -> None:
            try:
                answer.set_result(question(mission))
            except ValueError as error:
                answer.set_exception(RequestRefusedError(str(error)))

        self.enqueue(run)
        try:
            return answer.result(timeout=timeout_s)
        except TimeoutError as error:
            raise RequestRefusedError(
                f"the navigator is busy and did not answer within {timeout_s:g} s; try again"
            ) from error
