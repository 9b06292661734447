"""Clicks on the scene: commands for the robot, or requests for an explanation."""

import queue
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from app.nodes.console.link.commands import Actions, CommandError, act_at
from app.nodes.console.panels.drive import ClickTool, DrivePanel
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

    def __init__(
        self,
        server: Any,
        panel: DrivePanel | None,
        tool_of: Callable[[int], ClickTool | None],
        actions: Actions,
        floor_z_m: Callable[[], float],
    ) -> None:
        """Listen to the scene.

        Args:
            server: viser's.
            panel: Shows the answers; None makes every click ask for an explanation.
            tool_of: Returns what the clicks of a browser do, by its number; None to explain.
            actions: Sends the commands.
            floor_z_m: Returns the height of the floor that clicks are on.
        """
        self._panel = panel
        self._tool_of = tool_of
        self._actions = actions
        self._floor_z_m = floor_z_m
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
        panel, tool = self._panel, self._tool_of(event.client_id)
        if panel is None or tool is None or tool.chosen == "explain":
            if self._questions.qsize() < MAX_WAITING:
                self._questions.put((*ray, event.client_id))
            return
        panel.attempt(lambda: self._command(tool, *ray))

    def _dragged(self, panel: DrivePanel, event: Any) -> None:
        panel.attempt(lambda: self._paint_region(self._tool_of(event.client_id), event))

    def _paint_region(self, tool: ClickTool | None, event: Any) -> str:
        if tool is None or tool.chosen not in ("look_here", "not_here"):
            raise CommandError(self._actions.say("panel.drive.choose"))
        try:
            corners = floor_region(
                event.client.camera, event.screen_min, event.screen_max, self._floor_z_m()
            )
        except ValueError as error:
            raise CommandError(self._actions.say("click.not_floor")) from error
        dabs, radius_m = brush_strokes(corners)
        return self._actions.paint(tool.chosen, dabs, radius_m)

    def _command(self, tool: ClickTool, origin: Float64Array, direction: Float64Array) -> str:
        try:
            x, y, _ = floor_point(origin, direction, self._floor_z_m()).tolist()
        except ValueError as error:
            raise CommandError(self._actions.say("click.not_floor")) from error
        return act_at(self._actions, tool.chosen, x, y, tool.brush_m)
