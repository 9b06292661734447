"""Export files, requested by pages and written by the scene thread."""

import asyncio
import math
import queue
import threading
import time
from concurrent.futures import Future
from typing import Final

from app.view.exports import FILES
from app.view.model.scene_model import SceneModel
from app.view.plan.plan_scene import cells_state
from app.view.words import Words

PATIENCE_S: Final = 10.0
PLAN_CELLS: Final = "plan-cells.json"


class ExportRequests:
    """Queues requests of the gateway; the scene thread answers one at a time."""

    def __init__(self) -> None:
        self._orders: queue.SimpleQueue[tuple[str, Future[bytes | None]]] = queue.SimpleQueue()
        self._turn = asyncio.Lock()
        self._stale = threading.Event()
        self._cells_state: tuple[object, ...] = ()
        self._cells: bytes | None = None
        """Cells of the plan as last written."""
        self.plan_asked_s = -math.inf
        """When a plan was requested last, on the clock of `time.monotonic`."""

    async def order(self, name: str) -> bytes | None:
        """Return a file by its name, None if there is nothing to write yet.

        Raises:
            TimeoutError: The scene thread does not answer.
        """
        # One at a time, so that many requests cannot delay the scene.
        async with self._turn, asyncio.timeout(PATIENCE_S):
            future: Future[bytes | None] = Future()
            if name.startswith("plan"):
                self.plan_asked_s = time.monotonic()
            self._orders.put((name, future))
            return await asyncio.wrap_future(future)

    def names_changed(self) -> None:
        """Have the names on the plan asked for again, from any thread."""
        self._stale.set()

    def take_names_changed(self) -> bool:
        """Return whether a name has changed since the last call."""
        stale = self._stale.is_set()
        self._stale.clear()
        return stale

    def fill(self, model: SceneModel, say: Words) -> None:
        """Write the requested files. Called by the scene thread."""
        while not self._orders.empty():
            name, future = self._orders.get()
            if future.set_running_or_notify_cancel():
                future.set_result(self._written(name, model, say))

    def _written(self, name: str, model: SceneModel, say: Words) -> bytes | None:
        """Write a file; cells that every open plan asks for are written once."""
        write = FILES[name][1]
        if name != PLAN_CELLS:
            return write(model, say)
        state = cells_state(model)
        if state != self._cells_state:
            self._cells_state, self._cells = state, write(model, say)
        return self._cells
