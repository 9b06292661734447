"""The panel beside the scene, with its tabs."""

from typing import Any, Final

import viser

from app.nodes.console.link.commands import Actions
from app.nodes.console.panels.drive import DrivePanel
from app.nodes.console.panels.search import SearchPanel
from app.nodes.console.panels.session import SessionPanel
from app.view.model.scene_model import Part, SceneModel

WIDTH_PX: Final = 384


class Tabs:
    """Search, Drive, Map and Session, docked to the right.

    Each browser has its own Map tab, fields of a search, and choice of what its clicks do.

    For a recording there is no Drive tab, and nothing that commands the robot.
    """

    def __init__(self, server: viser.ViserServer, actions: Actions) -> None:
        self._server = server
        gui: Any = server.gui
        say = actions.say
        group = gui.add_tab_group()
        with group.add_tab(say("tab.search"), viser.Icon.SEARCH):
            self.search = SearchPanel(gui, actions)
        self.drive: DrivePanel | None = None
        if not actions.recorded:
            with group.add_tab(say("tab.drive"), viser.Icon.STEERING_WHEEL):
                self.drive = DrivePanel(gui, actions)
        self.map = group.add_tab(say("tab.map"), viser.Icon.MAP_2)
        with group.add_tab(say("tab.session"), viser.Icon.ACTIVITY):
            self._session = SessionPanel(gui, actions)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(WIDTH_PX)

    def update(self, model: SceneModel, changed: frozenset[Part]) -> None:
        """Show what changed."""
        with self._server.atomic():
            self.search.update(model, changed)
            if self.drive is not None:
                self.drive.update(model, changed)
            self._session.update(model, changed)
