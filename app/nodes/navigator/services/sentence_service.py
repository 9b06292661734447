"""Requests to read object and context from a sentence, by a language model or by rules."""

import time
from concurrent.futures import ThreadPoolExecutor
from typing import Final

from app.links.language_model.interface import (
    RULES,
    LanguageModelInterface,
    SentenceAnswer,
)
from app.messages.control import SentenceReading, SentenceRequest
from ippon.guidance.language.sentence import read_query

SENTENCE_TIMEOUT_S: Final = 8.0
"""Time after which rules read a sentence instead of the model, because a user is waiting."""


class SentenceService:
    """Reads sentences for every requester, without starting a search."""

    def __init__(self, model: LanguageModelInterface | None) -> None:
        self._model = model
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="sentence")

    def read(self, request: SentenceRequest) -> SentenceReading:
        """Return object and context of a sentence."""
        started = time.monotonic()
        answer = self._read(request.sentence)
        return SentenceReading(
            object=answer.query.object,
            context=answer.query.context,
            doubtful=answer.query.doubtful,
            provider=answer.provider,
            elapsed_ms=1e3 * (time.monotonic() - started),
            note=answer.failed,
        )

    def close(self) -> None:
        """Cancel pending questions; the model itself is closed by its owner."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _read(self, sentence: str) -> SentenceAnswer:
        failed = ""
        if self._model is not None:
            reading = self._pool.submit(self._model.read_query, sentence)
            try:
                return reading.result(timeout=SENTENCE_TIMEOUT_S)
            except TimeoutError:
                reading.cancel()
                failed = f"no answer within {SENTENCE_TIMEOUT_S:g} s"
        return SentenceAnswer(read_query(sentence), RULES, "", "", failed)
