"""Requests to read goals from a sentence, by a language model or by rules."""

import dataclasses
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Final

from app.links.language_model.interface import (
    RULES,
    LanguageModelInterface,
    SentenceAnswer,
)
from app.links.language_model.sentence_reading import as_reading
from app.messages.control import SentenceReading, SentenceRequest
from app.nodes.navigator.state.goal_queue import GoalQueue
from ippon.guidance.language.requests.goals import Goal
from ippon.guidance.language.requests.sentence import read_request

SENTENCE_TIMEOUT_S: Final = 8.0
"""Time after which rules read a sentence instead of the model, because a user is waiting."""


class SentenceService:
    """Reads sentences for every requester, without starting a search."""

    def __init__(self, model: LanguageModelInterface | None, goals: GoalQueue) -> None:
        self._model = model
        self._goals = goals
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="sentence")

    def read(self, request: SentenceRequest) -> SentenceReading:
        """Return what a sentence asks for."""
        started = time.monotonic()
        answer = self._read(request.sentence)
        return as_reading(answer, 1e3 * (time.monotonic() - started))

    def close(self) -> None:
        """Cancel pending questions; the model itself is closed by its owner."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _read(self, sentence: str) -> SentenceAnswer:
        failed = ""
        previous = self._previous()
        if self._model is not None:
            reading = self._pool.submit(self._model.read_request, sentence, previous)
            try:
                return reading.result(timeout=SENTENCE_TIMEOUT_S)
            except TimeoutError:
                reading.cancel()
                failed = f"no answer within {SENTENCE_TIMEOUT_S:g} s"
        return SentenceAnswer(read_request(sentence, previous), RULES, "", "", failed)

    def _previous(self) -> tuple[Goal, ...]:
        """Return the goal that was asked for last: "the other one" refers to it."""
        searches = self._goals.unfinished()
        last = searches[-1] if searches else self._goals.active()
        if last is None:
            return ()
        read = read_request(last.goal.display).goals
        label = last.goal.object.replace("_", " ")
        goal = read[0] if len(read) == 1 else Goal(object=label, display=last.goal.display)
        return (dataclasses.replace(goal, context=last.goal.context),)
