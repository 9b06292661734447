"""What each browser has of its own: Map tab, what is typed, clicks, its drawing once it differs."""

import queue
from collections.abc import Callable
from typing import Any, Final

from app.nodes.console.panels.drive import ClickTool
from app.nodes.console.panels.last_questions import Question
from app.nodes.console.panels.map import MapPanel
from app.nodes.console.panels.search import SearchPanel
from app.nodes.console.scene.scene_requests import ClickChoice
from app.nodes.console.web.browsers import Browser
from app.view.drawing.camera_follow import CameraFollow
from app.view.drawing.overlay_layer import NOTHING, Highlight
from app.view.drawing.subtree import Subtree
from app.view.drawing.viser_private import ignore_disconnect, send_whole_changes, uuid_of
from app.view.drawing.viser_scene import (
    ALL_PARTS,
    DARK_FLOOR,
    LIGHT_FLOOR,
    ROOTS,
    ViserScene,
    add_floor,
)
from app.view.model.scene_model import Part, SceneModel
from app.view.view_options import ViewOptions
from app.view.words import ENGLISH, Words
from ippon.geometry import Float64Array

OWN: Final = "/own"
"""Root of the scene nodes that only one browser has."""
_NEW_BROWSER_PARTS: Final[frozenset[Part]] = frozenset({"proximity"})
"""Parts shown in the controls of a new browser."""


class BrowserView:
    """View options and drawing of one browser.

    With the default options it sees the shared drawing. From the first change on it has its own
    drawing, and the shared one is hidden from it.
    """

    def __init__(
        self,
        client: Any,
        browser: Browser | None,
        tab: Any,
        clicks: Any,
        search: SearchPanel | None,
        on_change: Callable[[], None],
        say: Words,
    ) -> None:
        self.client = client
        send_whole_changes(client)
        self.options = ViewOptions() if browser is None else browser.view
        self.wants_framing = False
        self.browser = browser
        self._on_change = on_change
        self._words = say
        self._own: ViserScene | None = None
        self._is_new = True
        self._has_changed = self.options != ViewOptions()
        self._is_light = False
        self._search = search
        self._query = None
        if search is not None:
            draft = None if browser is None else browser.draft
            with client.atomic():
                self._query = search.open_form(client, draft, self._keep_draft)
        with client.atomic(), tab:
            self._panel = MapPanel(client.gui, self._choose, self._recall, say, self.options)
        self.tool: ClickTool | None = None
        """What a click on the map does; None where there is nothing to choose."""
        if clicks is not None:
            with client.atomic(), clicks:
                self.tool = ClickTool(client.gui, say)
        self._controls = {uuid_of(handle) for handle in self._panel.controls()}
        if self._query is not None:
            self._controls |= self._query.field_uuids()
        if browser is not None:
            browser.own_controls |= self._controls

    def draw(self, model: SceneModel, changed: frozenset[Part], highlight: Highlight) -> None:
        """Draw what changed; everything after a change of options."""
        is_light = self.browser is not None and self.browser.has_light_theme
        if is_light != self._is_light:
            # Only in this browser's scene, in place of the shared floor.
            self._is_light = is_light
            colors = LIGHT_FLOOR if is_light else DARK_FLOOR
            add_floor(self.client.scene, colors, model.floor_z_m)
        if self._has_changed:
            self._has_changed = False
            changed |= ALL_PARTS
            if self._own is None:
                self._own = self._drawing_of_its_own()
                self._own.overlay.draw_highlight(highlight)
        if changed and self._own is not None:
            self._own.draw(model, changed, self.options)
        if changed or self._is_new:
            self._panel.update(model, _NEW_BROWSER_PARTS if self._is_new else changed)
            self._is_new = False

    def highlight_for_all(self, highlight: Highlight) -> None:
        """Draw a highlight."""
        if self._own is not None:
            self._own.overlay.draw_highlight(highlight)

    def close(self) -> None:
        """Release this browser's controls."""
        if self.browser is not None:
            self.browser.own_controls -= self._controls
        if self._search is not None and self._query is not None:
            self._search.close_form(self._query)

    def _keep_draft(self, typed: Question) -> None:
        if self.browser is not None:
            self.browser.draft = typed

    def _drawing_of_its_own(self) -> ViserScene:
        for name in ROOTS:
            # Only in this browser's scene: hides the node of the same name in the shared scene.
            self.client.scene.add_frame(name, show_axes=False, visible=False)
        return ViserScene(Subtree(self.client, OWN), self._words)

    def _choose(self, options: ViewOptions) -> None:
        self.options = options
        if self.browser is not None:
            self.browser.view = options
        self._has_changed = True
        self._on_change()

    def _recall(self) -> None:
        self.wants_framing = True
        self._on_change()


class BrowserViews:
    """All browsers' views; viser's threads call `join` and `leave`, the scene thread the rest."""

    def __init__(
        self,
        server: Any,
        tab: Any,
        clicks: Any,
        follow: CameraFollow,
        on_change: Callable[[], None],
        say: Words = ENGLISH,
        search: SearchPanel | None = None,
    ) -> None:
        """Create the shared drawing.

        Args:
            server: viser's.
            tab: Container of each browser's own Map tab.
            clicks: Container of what each browser's clicks do; None for a recording.
            follow: Keeps the map in view in each browser.
            on_change: Called when a browser has changed its options.
            say: The words of the controls.
            search: The Search tab, which has fields of each browser; None for no such tab.
        """
        self._words = say
        self._search = search
        self._common = ViserScene(server, say)
        self._tab = tab
        self._clicks = clicks
        self._follow = follow
        self._on_change = on_change
        self._news: queue.SimpleQueue[tuple[Any, Browser | None, bool]] = queue.SimpleQueue()
        self._open: dict[int, BrowserView] = {}
        self._highlight = NOTHING

    def join(self, client: Any, browser: Browser | None) -> None:
        """Add a browser that has connected."""
        self._news.put((client, browser, True))
        self._on_change()

    def leave(self, client: Any) -> None:
        """Remove a browser that has disconnected."""
        self._news.put((client, None, False))

    def options_of(self, client_id: int) -> ViewOptions:
        """Return the view options of a browser."""
        view = self._open.get(client_id)
        return ViewOptions() if view is None else view.options

    def tool_of(self, client_id: int) -> ClickTool | None:
        """Return what the clicks of a browser do; None for one that has not been added yet."""
        view = self._open.get(client_id)
        return None if view is None else view.tool

    def of(self, browser: Browser) -> list[BrowserView]:
        """Return the views that a browser has open."""
        return [view for view in self._open.values() if view.browser is browser]

    def click_choice(self, browser: Browser) -> ClickChoice | None:
        """Return what a click does in a browser; None if its pages differ, or there is none."""
        choices = {
            ClickChoice(tool=tool.chosen, brush_m=tool.brush_m)
            for view in self.of(browser)
            if (tool := view.tool) is not None
        }
        return choices.pop() if len(choices) == 1 else None

    def highlight_for_all(self, highlight: Highlight) -> None:
        """Draw a highlight in all browsers."""
        self._highlight = highlight
        self._common.overlay.draw_highlight(highlight)
        for view in self._open.values():
            with ignore_disconnect(view.client):
                view.highlight_for_all(highlight)

    def draw(self, model: SceneModel, changed: frozenset[Part]) -> None:
        """Draw what changed, in the shared drawing and in those of single browsers."""
        if changed:
            self._common.draw(model, changed, ViewOptions())
        self._admit()
        for view in self._open.values():
            # One message: a browser would draw each part of a change, and that can take long.
            with ignore_disconnect(view.client), view.client.atomic():
                view.draw(model, changed, self._highlight)
            if view.wants_framing:
                view.wants_framing = False
                self._follow.frame_map(view.client)

    def bounds(self) -> tuple[Float64Array, Float64Array] | None:
        """Return the least and greatest (x, y) of the map in metres; None without one."""
        return self._common.bounds()

    def _admit(self) -> None:
        while not self._news.empty():
            client, browser, comes = self._news.get()
            if comes:
                with ignore_disconnect(client):
                    self._open[client.client_id] = BrowserView(
                        client,
                        browser,
                        self._tab,
                        self._clicks,
                        self._search,
                        self._on_change,
                        self._words,
                    )
                self._follow.add(client)
                continue
            self._follow.remove(client)
            view = self._open.pop(client.client_id, None)
            if view is not None:
                view.close()
