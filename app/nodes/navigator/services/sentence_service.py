"""Requests to read goals from a sentence, by a language model or by rules, or from a picture."""

import dataclasses
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Final

import simplejpeg

from app.links.language_model.interface import (
    RULES,
    LanguageModelInterface,
    SentenceAnswer,
)
from app.links.language_model.sentence_reading import as_reading
from app.links.network.query_queue import waited_s
from app.links.network.requests import RequestRefusedError
from app.messages.control import PictureRequest, SentenceReading, SentenceRequest
from app.nodes.navigator.state.goal_queue import GoalQueue
from ippon.guidance.language.goals.goal import Goal
from ippon.guidance.language.requests.sentence import read_request
from ippon.memory.instance import Instance
from ippon.memory.notes import with_names, without_names
from ippon.rooms.named_rooms import RoomName
from ippon.vocabulary import in_words

SENTENCE_TIMEOUT_S: Final = 8.0
"""Time after which rules read a sentence instead of the model, because a user is waiting; it
includes the time that the sentence waited for others to be read."""
PICTURE_TIMEOUT_S: Final = 20.0
"""Time for a model to name what a picture shows, counted alike; nothing can replace it."""
NO_MODEL: Final = (
    "a picture needs a language model that takes images, and the navigator has none: start it with "
    "--llm.model NAME, or say in words what to look for"
)


class SentenceService:
    """Reads sentences and pictures for every requester, without starting a search."""

    def __init__(self, model: LanguageModelInterface | None, goals: GoalQueue) -> None:
        self._model = model
        self._goals = goals
        self.things: Callable[[], tuple[Instance, ...]] = tuple
        """Returns what is remembered; the navigator sets it."""
        self.room_names: Callable[[], tuple[RoomName, ...]] = tuple
        """Returns the names that people have given to rooms; the navigator sets it."""
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="sentence")

    def read(self, request: SentenceRequest) -> SentenceReading:
        """Return what a sentence asks for."""
        started = time.monotonic()
        sentence, things = without_names(request.sentence, self.things())
        answer = self._read(sentence)
        if things:
            goals = with_names(answer.request.goals, things)
            answer = dataclasses.replace(
                answer, request=dataclasses.replace(answer.request, goals=goals)
            )
        names = [room.name for room in self.room_names()]
        return as_reading(answer, 1e3 * (time.monotonic() - started), names)

    def read_picture(self, request: PictureRequest) -> SentenceReading:
        """Return the object that a picture shows, as the model names it.

        Raises:
            RequestRefusedError: There is no model, it was late, or the picture is no JPEG image.
        """
        if self._model is None:
            raise RequestRefusedError(NO_MODEL)
        try:
            simplejpeg.decode_jpeg_header(request.jpeg)
        except ValueError:
            raise RequestRefusedError("the picture is not a JPEG image") from None
        started = time.monotonic()
        try:
            answer = self._ask(PICTURE_TIMEOUT_S, self._model.read_picture, request.jpeg)
        except TimeoutError:
            raise RequestRefusedError(
                f"{self._model.name} did not say within {PICTURE_TIMEOUT_S:g} s what the picture "
                "shows: say in words what to look for"
            ) from None
        return as_reading(answer, 1e3 * (time.monotonic() - started))

    def close(self) -> None:
        """Cancel pending questions; the model itself is closed by its owner."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _read(self, sentence: str) -> SentenceAnswer:
        failed = ""
        previous = self._previous()
        if self._model is not None:
            try:
                return self._ask(SENTENCE_TIMEOUT_S, self._model.read_request, sentence, previous)
            except TimeoutError:
                failed = f"no answer within {SENTENCE_TIMEOUT_S:g} s"
        return SentenceAnswer(read_request(sentence, previous), RULES, "", "", failed)

    def _ask(
        self, timeout_s: float, question: Callable[..., SentenceAnswer], *of: object
    ) -> SentenceAnswer:
        """Ask the model, in its own thread.

        Raises:
            TimeoutError: It was late, counted from the arrival of the request that is answered.
        """
        left_s = timeout_s - waited_s()
        if left_s <= 0.0:
            raise TimeoutError
        reading = self._pool.submit(question, *of)
        try:
            return reading.result(timeout=left_s)
        finally:
            reading.cancel()

    def _previous(self) -> tuple[Goal, ...]:
        """Return the goal that was asked for last: "the other one" refers to it."""
        searches = self._goals.unfinished()
        last = searches[-1] if searches else self._goals.active()
        if last is None:
            return ()
        label = in_words(last.goal.object)
        # What is shown of a thing is its name, which says nothing of others of its kind.
        display = last.goal.display if last.goal.thing_id is None else label
        read = read_request(display).goals
        goal = read[0] if len(read) == 1 else Goal(object=label, display=display)
        return (dataclasses.replace(goal, context=last.goal.context),)
