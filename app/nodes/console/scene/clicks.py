"""Clicks on the scene: commands for the robot, or requests for an explanation."""

import queue
from typing import Any, Final

import numpy as np

from app.nodes.console.link.commands import Actions, CommandError
from app.nodes.console.panels.drive import DrivePanel, Tool
from app.view.model.drag_region import brush_strokes, floor_region
from app.view.model.picking import floor_point
from ippon.geometry import Float64Array

Ray = tuple[Float64Array, Float64Array]
"""Origin and direction in the world."""
Question = tuple[Float64Array, Float64Array, int]
"""A ray, and the browser whose click it was."""

MAX_WAITING: Final = 8
NOBODY: Final = -1
"""Browser of a question that no open view has asked."""


class Clicks:
    """Sends commands in the thread of the click; explanations wait for the scene thread."""

    def __init__(self, server: Any, panel: DrivePanel | None, actions: Actions) -> None:
        """Listen to the scene.

        Args:
            server: viser's.
            panel: Selects what a click does; None makes every click ask for an explanation.
            actions: Sends the commands.
        """
        self._panel = panel
        self._actions = actions
        self._questions: queue.SimpleQueue[Question] = queue.SimpleQueue()
        server.scene.on_click()(self._clicked)
        if panel is not None:
            server.scene.on_rect_select(modifier="shift")(lambda event: self._dragged(panel, event))

    def questions(self) -> list[Question]:
        """Take the clicks that wait for an explanation."""
        rays: list[Question] = []
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
        panel = self._panel
        if panel is None or panel.tool == "explain":
            if self._questions.qsize() < MAX_WAITING:
                self._questions.put((*ray, event.client_id))
            return
        panel.attempt(lambda: self._command(panel, *ray))

    def _dragged(self, panel: DrivePanel, event: Any) -> None:
        panel.attempt(lambda: self._paint_region(panel.tool, event))

    def _paint_region(self, tool: Tool, event: Any) -> str:
        if tool not in ("look_here", "not_here"):
            raise CommandError(self._actions.say("panel.drive.choose"))
        try:
            corners = floor_region(event.client.camera, event.screen_min, event.screen_max, 0.0)
        except ValueError as error:
            raise CommandError(self._actions.say("click.not_floor")) from error
        dabs, radius_m = brush_strokes(corners)
        return self._actions.paint(tool, dabs, radius_m)

    def _command(self, panel: DrivePanel, origin: Float64Array, direction: Float64Array) -> str:
        try:
            x, y, _ = floor_point(origin, direction, 0.0).tolist()
        except ValueError as error:
            raise CommandError(self._actions.say("click.not_floor")) from error
        if panel.tool == "go":
            return self._actions.go_to(x, y)
        action = "look_here" if panel.tool == "look_here" else "not_here"
        return self._actions.paint(action, [(x, y)], panel.brush_m)
