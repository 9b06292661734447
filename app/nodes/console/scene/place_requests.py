"""Rooms and remembered things, requested from the navigator while a page shows them."""

import logging
import queue
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Final

from app.messages.memory import MemoryReply, RoomsReply
from app.nodes.console.link.commands import CommandError
from app.nodes.console.link.panel_requests import PanelRequests
from app.view.model.scene_model import SceneModel

logger = logging.getLogger(__name__)

EVERY_S: Final = 4.0
WANTED_S: Final = 6.0
"""Time after the last look at a plan for which its names are kept fresh."""


class PlaceRequests:
    """Requests in a thread of its own; the scene thread calls the methods."""

    def __init__(self, link: PanelRequests) -> None:
        self._link = link
        self._answers: queue.SimpleQueue[tuple[RoomsReply, MemoryReply]] = queue.SimpleQueue()
        self._asked_s = -EVERY_S
        self._pending = threading.Event()
        self._again = False
        self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="places")

    def step(self, model: SceneModel, wanted_s: float, *, again: bool = False) -> None:
        """Take answers, and ask if it is time.

        Args:
            model: Gets the answers.
            wanted_s: When somebody looked last, on the clock of `time.monotonic`.
            again: Ask at once, because a name has changed.
        """
        while not self._answers.empty():
            rooms, things = self._answers.get()
            model.on_places(rooms.rooms, things.things)
        self._again |= again
        now = time.monotonic()
        due = now - self._asked_s >= EVERY_S or self._again
        if due and now - wanted_s < WANTED_S and not self._pending.is_set():
            self._asked_s = now
            self._again = False
            self._pending.set()
            self._executor.submit(self._ask)

    def close(self) -> None:
        """End the thread."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _ask(self) -> None:
        try:
            self._answers.put((self._link.rooms(), self._link.things()))
        except CommandError as error:
            logger.debug("no rooms and things: %s", error)
        finally:
            self._pending.clear()
