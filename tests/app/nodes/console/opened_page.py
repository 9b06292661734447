"""A console's page in a real browser, and what tests do on it."""

import os
import re
import time

from playwright.sync_api import expect

from tests.chromium import KEEP_PICTURES, PATIENCE_MS, new_window

_SCENE = re.compile("/view/|/assets/viser-")
WHOLE_MAP_TICKS = 30
"""After these the map has all of its voxels, and the hat."""


class PageParts:
    """A console, the navigator that it watches, and a window to open its page in."""

    def __init__(self, stage, browser, navigator=True, is_drawn=False, **home):
        self.zenoh_port, self.port = stage.free_port(), stage.free_port()
        self.home = stage.PublishedHome(self.zenoh_port, **home) if navigator else None
        self.console = stage.ConsoleProcess(self.zenoh_port, self.port)
        self.window = new_window(browser, is_drawn=is_drawn)
        # The map is looked at by its pixels, which the camera's picture would cover.
        self.window.add_init_script("localStorage.setItem('ippon-camera', 'off')")
        self.console.wait_until_up()

    def hold_still(self):
        """Show the whole map from now on, and publish the status only.

        A scene that changes costs a third of a core to draw.
        """
        while self.home.ticks < WHOLE_MAP_TICKS:
            self.home.tick()
        self.home.frozen = True

    def open_page(self, *, scene=True):
        """Open the page as an operator would; without its scene for less than half of the work."""
        page = self.window.new_page()
        if not scene:
            leave_out_scene(page)
        page.goto(self.console.url)
        return page

    def close(self):
        self.window.close()
        self.console.close()
        if self.home is not None:
            self.home.close()


def leave_out_scene(page):
    """Load no scene into a page, unless pictures of it are kept."""
    if KEEP_PICTURES not in os.environ:
        page.route(_SCENE, lambda route: route.abort())


def panels(page):
    return page.frame_locator("#view")


def open_tab(page, name):
    panels(page).get_by_role("tab", name=name, exact=True).click()


def text_field(page, label):
    """The text field beside a label; viser does not tie the two together."""
    return panels(page).locator(
        f"xpath=//label[text()='{label}']/ancestor::div[.//input][1]//input"
    )


def wait_until(page, arrived, wanted):
    """Wait until something is among what has arrived, of which the page says nothing."""
    deadline = time.monotonic() + PATIENCE_MS / 1e3
    while wanted not in arrived():
        assert time.monotonic() < deadline, f"no {wanted} in {arrived()}"
        page.wait_for_timeout(20)


def expect_state(page, text):
    expect(page.locator("#state")).to_have_text(text)
    # A Stop without a quick reply is sent twice, and could come in the test after this one.
    expect(page.locator("#stop[data-pending]")).to_have_count(0)
