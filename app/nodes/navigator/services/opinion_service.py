"""Asks a vision-language model about finds, in a thread of its own."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Final

import simplejpeg

from app.links.language_model.interface import LanguageModelInterface
from app.nodes.navigator.services.operation_queue import OperationQueue
from ippon.mission.finds.second_opinion import Opinion, OpinionRequest
from ippon.mission.mission import Mission

_QUALITY: Final = 90


class OpinionService:
    """Asks the model for the mission and returns its answers to the mission's thread.

    Args:
        model: A model that takes images.
        operations: Queue of the mission's thread.
    """

    def __init__(self, model: LanguageModelInterface, operations: OperationQueue) -> None:
        self._model = model
        self._operations = operations
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="opinion")

    def ask(self, request: OpinionRequest) -> None:
        """Ask in the background; returns at once."""
        self._pool.submit(self._ask, request)

    def close(self) -> None:
        """Cancel pending questions."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _ask(self, request: OpinionRequest) -> None:
        jpeg = simplejpeg.encode_jpeg(request.crop, _QUALITY, "RGB", "444")
        opinion = self._model.second_opinion(jpeg, request.object)
        self._operations.enqueue(partial(_answer, request.number, opinion))


def _answer(number: int, opinion: Opinion, mission: Mission) -> None:
    mission.opinions.answer(number, opinion)
