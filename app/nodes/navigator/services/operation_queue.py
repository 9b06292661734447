"""Operations that other threads queue for the mission, and questions that it answers."""

import logging
import threading
import time
from collections import deque
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
MAX_WAITING: Final = 200
"""Operations that may wait before requests are refused."""
ROUND_S: Final = 0.1
"""Time after which the other operations wait for the next frame."""


class OperationQueue:
    """First-in, first-out queue of operations; safe from any thread."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """Create an empty queue; `wake` ends the mission thread's wait for a frame."""
        self.wake = wake
        self._lock = threading.Lock()
        self._operations: deque[Operation] = deque()

    def enqueue(self, operation: Operation) -> None:
        """Queue an operation and wake the mission's thread."""
        with self._lock:
            self._operations.append(operation)
        self.wake()

    def enqueue_first(self, operation: Operation) -> None:
        """Queue an operation before all others, once, and wake the mission's thread."""
        with self._lock:
            if not self._operations or self._operations[0] != operation:
                self._operations.appendleft(operation)
        self.wake()

    def check_room(self) -> None:
        """Refuse a request while too many operations wait.

        Raises:
            RequestRefusedError: More than `MAX_WAITING` wait.
        """
        if len(self._operations) > MAX_WAITING:
            raise RequestRefusedError(
                f"the navigator is busy: {MAX_WAITING} requests wait; try again in a moment"
            )

    def run_queued(self, mission: Mission) -> None:
        """Run the queued operations in order, for `ROUND_S`; called by the mission's thread."""
        until = time.monotonic() + ROUND_S
        while time.monotonic() < until:
            with self._lock:
                if not self._operations:
                    return
                operation = self._operations.popleft()
            try:
                operation(mission)
            except Exception:  # One failing request must not end the navigator.
                logger.exception("a request failed")

    def ask(self, question: Callable[[Mission], T], timeout_s: float | None = None) -> T:
        """Return the answer that the mission's thread computes.

        Args:
            question: Called with the mission, in its thread.
            timeout_s: How long to wait for it; by default `ANSWER_S`.

        Raises:
            RequestRefusedError: Too many operations wait, the question raised `ValueError`, or no
                answer came in time.
            Exception: What else the question raised.
        """
        self.check_room()
        if timeout_s is None:
            timeout_s = ANSWER_S
        answer: Future[T] = Future()

        def run(mission: Mission) -> None:
            if not answer.set_running_or_notify_cancel():
                return  # It was refused meanwhile: a robot must not drive to a point later.
            try:
                answer.set_result(question(mission))
            except ValueError as error:
                answer.set_exception(RequestRefusedError(str(error)))
            except Exception as error:  # noqa: BLE001 - raised in the thread that waits
                answer.set_exception(error)

        self.enqueue(run)
        try:
            return answer.result(timeout=timeout_s)
        except TimeoutError as error:
            if not answer.cancel():
                return answer.result()  # It is under way.
            raise RequestRefusedError(
                f"the navigator is busy and did not answer within {timeout_s:g} s; try again"
            ) from error
