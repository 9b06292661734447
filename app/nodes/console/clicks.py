"""Clicks on the scene: some are commands, in the clicker's name; some are questions."""

import queue
from typing import Any, Final

import numpy as np

from app.nodes.console.commands import Actions, CommandError
from app.nodes.console.panels.drive import DrivePanel
from app.view.picking import floor_point
from ippon.geometry import Float64Array

Ray = tuple[Float64Array, Float64Array]
"""Origin and direction in the world."""

MAX_WAITING: Final = 8


class Clicks:
    """Commands go out in the thread that the click came in; questions wait for the conductor."""

    def __init__(self, server: Any, panel: DrivePanel, actions: Actions) -> None:
        self._panel = panel
        self._actions = actions
        self._questions: queue.SimpleQueue[Ray] = queue.SimpleQueue()
        server.scene.on_click()(self._clicked)

    def questions(self) -> list[Ray]:
        """Take the rays that ask for an explanation."""
        rays: list[Ray] = []
        while True:
            try:
                rays.append(self._questions.get_nowait())
            except queue.Empty:
                return rays

    def _clicked(self, event: Any) -> None:
        if event.ray_origin is None or event.ray_direction is None:
            return
        ray = np.array(event.ray_origin), np.array(event.ray_direction)
        if not np.isfinite(ray).all() or not ray[1].any():
            return
        if self._panel.tool == "explain":
            if self._questions.qsize() < MAX_WAITING:
                self._questions.put(ray)
            return
        self._panel.attempt(lambda: self._command(*ray))

    def _command(self, origin: Float64Array, direction: Float64Array) -> str:
        try:
            x, y, _ = floor_point(origin, direction, 0.0).tolist()
        except ValueError as error:
            raise CommandError(str(error)) from error
        if self._panel.tool == "go":
            return self._actions.go_to(x, y)
        wish = "look_here" if self._panel.tool == "look_here" else "not_here"
        return self._actions.paint(wish, [(x, y)], self._panel.brush_m)
