"""MissionQueries that only the mission's thread can answer."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Final, TypeVar

from app.links.network.requests import RequestRefusedError
from ippon.mission.mission import Mission

T = TypeVar("T")
ANSWER_S: Final = 1.8
"""So long a request waits for the mission's thread, which may be in the middle of a step."""

Enqueue = Callable[[Callable[[Mission], None]], None]


class MissionQueries:
    """Hands questions over and waits for the answers, in whatever thread asks."""

    def __init__(self, put: Enqueue, answer_s: float = ANSWER_S) -> None:
        self._put = put
        self._answer_s = answer_s

    def ask(self, question: Callable[[Mission], T]) -> T:
        """Have the mission's thread answer.

        Raises:
            RequestRefusedError: It says that the question makes no sense, or has no time.
        """
        answer: Future[T] = Future()

        def run(mission: Mission) -> None:
            try:
                answer.set_result(question(mission))
            except ValueError as error:
                answer.set_exception(RequestRefusedError(str(error)))

        self._put(run)
        try:
            return answer.result(timeout=self._answer_s)
        except TimeoutError as error:
            raise RequestRefusedError(
                f"the navigator is busy and did not answer within {self._answer_s:g} s; try again"
            ) from error
