"""The Drive tab: drive mode, speed limit, and what a click on the map does."""

from collections.abc import Callable
from typing import Any, Final, Literal

from app.messages.driving import DriveModeName, DriveStatus
from app.nodes.console.link.commands import Actions, CommandError
from app.nodes.console.panels import markup
from app.view.colors import QUIET
from app.view.model.scene_model import Part, SceneModel

Tool = Literal["explain", "go", "look_here", "not_here"]

MODES: Final[dict[str, DriveModeName]] = {
    "Auto": "auto",
    "Assisted": "assisted",
    "Manual": "manual",
}
MODE_TEXT: Final[dict[DriveModeName, str]] = {
    "auto": "The robot drives by itself.",
    "assisted": "Hold W: the planner steers and you set the speed. Steer yourself with A, D and S. "
    "Release all keys to stop.",
    "manual": "Drive with W A S D, in curves with Q E, and tilt the camera with R F. "
    "Release all keys to stop. Mapping continues.",
}
TOOLS: Final[dict[str, Tool]] = {
    "Explain": "explain",
    "Go": "go",
    "Look here": "look_here",
    "Not here": "not_here",
}
TOOL_TEXT: Final[dict[Tool, str]] = {
    "explain": "Click a viewpoint or a surface to see what the map stores about it.",
    "go": "Click the floor: the robot drives there, then continues its search.",
    "look_here": "Click the floor where to search first, or hold Shift and drag a rectangle.",
    "not_here": "Click the floor where not to search, or hold Shift and drag a rectangle.",
}


class DrivePanel:
    """Builds the tab inside the current container and updates it from the model."""

    def __init__(self, gui: Any, actions: Actions) -> None:
        self._actions = actions
        self._drive = DriveStatus()
        self.tool: Tool = "explain"
        """What a click on the map does."""
        self._mode = gui.add_button_group("Drive mode", tuple(MODES))
        self._mode_text = gui.add_html("")
        self._limit = gui.add_slider(
            "Speed limit, %",
            min=10,
            max=100,
            step=5,
            initial_value=100,
            hint="Percent of the robot's top speed, in every mode",
        )
        self._filter = gui.add_html("")
        self._cancel = gui.add_button("Cancel this waypoint", color=QUIET, visible=False)
        with gui.add_folder("A click on the map"):
            self._tools = gui.add_button_group("does", tuple(TOOLS))
            self._tool_text = gui.add_html("")
            self._brush = gui.add_slider(
                "Brush, m", min=0.2, max=2.0, step=0.1, initial_value=0.6, hint="Radius in metres"
            )
            self._undo = gui.add_button_group("Painted", ("Undo", "Clear"))
        self._answer = gui.add_html("")
        self._mode.on_click(lambda event: self._set_mode(MODES[event.target.value]))
        self._limit.on_update(lambda _: self._set_mode(self._drive.mode))
        self._cancel.on_click(lambda _: self.attempt(actions.cancel_go_to))
        self._tools.on_click(lambda event: self._choose(TOOLS[event.target.value]))
        self._undo.on_click(lambda event: self._unpaint(event.target.value))
        self._show(DriveStatus())
        self._choose("explain")

    @property
    def brush_m(self) -> float:
        """Radius of the brush in metres."""
        return float(self._brush.value)

    def update(self, model: SceneModel, changed: frozenset[Part]) -> None:
        """Show what changed."""
        if "status" in changed and model.status is not None:
            self._show(model.status.drive)

    def attempt(self, command: Callable[[], str]) -> None:
        """Run a command and show its result."""
        try:
            self._answer.content = markup.answer(command(), ok=True)
        except CommandError as error:
            self._answer.content = markup.answer(str(error), ok=False)

    def _set_mode(self, mode: DriveModeName) -> None:
        limit = float(self._limit.value) / 100.0
        self.attempt(lambda: self._actions.set_drive(mode, limit))

    def _choose(self, tool: Tool) -> None:
        self.tool = tool
        self._tool_text.content = markup.choice(tool, TOOL_TEXT[tool])

    def _unpaint(self, word: str) -> None:
        undo = word == "Undo"
        self.attempt(lambda: self._actions.paint("undo" if undo else "clear", (), 0.5))

    def _show(self, drive: DriveStatus) -> None:
        if drive == self._drive and self._mode_text.content:
            return
        self._drive = drive
        self._mode_text.content = markup.choice(drive.mode, MODE_TEXT[drive.mode])
        self._filter.content = markup.intervention(drive)
        self._cancel.visible = drive.waypoint is not None
