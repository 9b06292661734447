"""The Drive tab: drive mode, speed limit, and what a browser's clicks on the map do."""

from collections.abc import Callable
from typing import Any, Final, get_args

from app.messages.driving import DriveModeName, DriveStatus
from app.nodes.console.link.commands import Actions, ClickAction
from app.nodes.console.panels import markup
from app.nodes.console.panels.drive_markup import intervention, painted
from app.nodes.console.panels.map import value_of
from app.nodes.console.panels.markup import attempt
from app.view.colors import QUIET
from app.view.model.painted_area import mapped_m2
from app.view.model.scene_model import Part, SceneModel
from app.view.words import Words

MODES: Final[tuple[DriveModeName, ...]] = get_args(DriveModeName)
TOOLS: Final[tuple[ClickAction, ...]] = get_args(ClickAction)


class ClickTool:
    """What a click on the map does, in one browser; built inside the current container."""

    def __init__(self, gui: Any, say: Words) -> None:
        """Add the controls.

        Args:
            gui: viser's, of the browser.
            say: The words of the controls.
        """
        self.chosen: ClickAction = "explain"
        self._words = say
        tools: dict[str, ClickAction] = {say(f"panel.drive.{tool}"): tool for tool in TOOLS}
        self._tools = gui.add_button_group(say("panel.drive.does"), tuple(tools))
        self._text = gui.add_html("")
        self._brush = gui.add_slider(
            say("panel.drive.brush"),
            min=0.2,
            max=2.0,
            step=0.1,
            initial_value=0.6,
            hint=say("panel.drive.brush.hint"),
        )
        self._tools.on_click(lambda event: self._choose(tools[event.target.value]))
        self._choose("explain")

    @property
    def brush_m(self) -> float:
        """Radius of the brush in metres."""
        return value_of(self._brush)

    def _choose(self, tool: ClickAction) -> None:
        self.chosen = tool
        self._text.content = markup.choice(tool, self._words(f"panel.drive.{tool}.text"))


class DrivePanel:
    """Builds the tab inside the current container and updates it from the model."""

    def __init__(self, gui: Any, actions: Actions) -> None:
        self._actions = actions
        self._drive = DriveStatus()
        self._is_stopped = False
        say = self._words = actions.say
        modes: dict[str, DriveModeName] = {say(f"panel.drive.{mode}"): mode for mode in MODES}
        self._mode = gui.add_button_group(say("panel.drive.mode"), tuple(modes))
        self._mode_text = gui.add_html("")
        self._limit = gui.add_slider(
            say("panel.drive.limit"),
            min=10,
            max=100,
            step=5,
            initial_value=100,
            hint=say("panel.drive.limit.hint"),
        )
        self._filter = gui.add_html("")
        self._cancel = gui.add_button(say("panel.drive.cancel"), color=QUIET, visible=False)
        self.clicks = gui.add_folder(say("panel.drive.click"))
        """Container of each browser's `ClickTool`."""
        self._undo = gui.add_button_group(
            say("panel.drive.painted"), (say("panel.drive.undo"), say("panel.drive.clear"))
        )
        self._regions = gui.add_html("")
        self._answer = gui.add_html("")
        self._mode.on_click(lambda event: self._set_mode(modes[event.target.value]))
        self._limit.on_update(self._move_limit)
        self._cancel.on_click(lambda _: self.attempt(actions.cancel_go_to))
        self._undo.on_click(lambda event: self._unpaint(event.target.value))
        self._show(DriveStatus(), is_stopped=False)

    def update(self, model: SceneModel, changed: frozenset[Part]) -> None:
        """Show what changed."""
        if "status" in changed and model.status is not None:
            self._show(model.status.drive, is_stopped=model.status.state == "stopped")
        if "painted" in changed:
            self._list_painted(model)

    def _list_painted(self, model: SceneModel) -> None:
        """List what is painted, with how much of the map it covers."""
        areas = mapped_m2(model.painted, model.voxels, model.voxel_size_m or 0.0)
        regions = list(zip(model.painted, areas, strict=True))
        self._regions.content = painted(regions, self._words)

    def attempt(self, command: Callable[[], str]) -> bool:
        """Run a command and show its result; return whether it was carried out."""
        return attempt(self._answer, command)

    def _set_mode(self, mode: DriveModeName) -> bool:
        # Mode and limit are sent alone: the other may have changed since the last status.
        return self.attempt(lambda: self._actions.set_drive(mode=mode))

    def _move_limit(self, event: Any) -> None:
        # Without a client it is the navigator's limit that `_show` has shown.
        if event.client is None:
            return
        limit = float(self._limit.value) / 100.0
        if not self.attempt(lambda: self._actions.set_drive(speed_limit=limit)):
            self._limit.value = _shown_limit(self._drive)

    def _unpaint(self, word: str) -> None:
        undo = word == self._words("panel.drive.undo")
        self.attempt(lambda: self._actions.paint("undo" if undo else "clear", (), 0.5))

    def _show(self, drive: DriveStatus, *, is_stopped: bool) -> None:
        if (drive, is_stopped) == (self._drive, self._is_stopped) and self._mode_text.content:
            return
        has_arrived = self._drive.waypoint is not None and drive.waypoint is None
        if drive.mode != self._drive.mode or has_arrived:
            # What was answered about another mode, or about a way that is over, holds no more.
            self._answer.content = ""
        if drive.speed_limit != self._drive.speed_limit:
            self._limit.value = _shown_limit(drive)
        self._drive, self._is_stopped = drive, is_stopped
        does = "stopped" if is_stopped else drive.mode
        mode_text = self._words(f"panel.drive.{does}.text")
        self._mode_text.content = markup.choice(drive.mode, mode_text)
        self._filter.content = intervention(drive, self._words)
        self._cancel.visible = drive.waypoint is not None


def _shown_limit(drive: DriveStatus) -> int:
    """Return the speed limit in percent, as the slider has it."""
    return round(100.0 * drive.speed_limit)
