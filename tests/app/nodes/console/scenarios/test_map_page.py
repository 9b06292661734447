"""The map on the page, in a real browser: as it grows, in its colours, and after a broken link."""

import time

import pytest
from playwright.sync_api import expect

from app.links.network.session import open_router
from app.messages import keys
from app.messages.control import QueueRequest, encode
from app.nodes.navigator.run import starting
from tests.app.nodes.console.opened_page import (
    PageParts,
    expect_state,
    open_tab,
    panels,
    wait_until,
)
from tests.chromium import PATIENCE_MS

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def growing(stage, browser):
    """A console, its page, and a home whose map grows."""
    parts = PageParts(stage, browser, is_drawn=True)
    parts.page = parts.open_page()
    yield parts
    parts.close()


@pytest.fixture
def early(stage, browser):
    """A console without a navigator."""
    parts = PageParts(stage, browser, navigator=False, is_drawn=True)
    yield parts
    parts.close()


def _picture(page, tmp_path):
    """Return the scene's pixels, (H, W, 3)."""
    import numpy as np
    from PIL import Image

    path = tmp_path / f"{time.monotonic_ns()}.png"
    page.screenshot(path=path, clip={"x": 8, "y": 120, "width": 952, "height": 740})
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def _lit(picture):
    """Return which pixels are lit, (H, W)."""
    return picture.max(axis=2) > 90


def _drawn(page, tmp_path):
    """Wait until the map fills a good part of the picture."""
    return _shown(page, tmp_path, lambda seen: _lit(seen).mean() > 0.2, "the scene stays dark")


def _shown(page, tmp_path, wanted, complaint):
    """Wait until the picture is as wanted, and return it."""
    deadline = time.monotonic() + PATIENCE_MS / 1000.0
    while time.monotonic() < deadline:
        picture = _picture(page, tmp_path)
        if wanted(picture):
            return picture
        page.wait_for_timeout(200)
    raise TimeoutError(complaint)


def test_shows_the_search_as_it_goes(growing, tmp_path):
    page = growing.page
    expect_state(page, "Searching")
    expect(page.locator("#goal")).to_have_text("hat")
    expect(page.locator("#robot")).to_have_text("ippon")
    expect(page.locator("#link")).to_contain_text("live")
    expect(page.locator("#veil")).to_be_hidden()
    view = panels(page)
    expect(view.get_by_text("going to the viewpoint by the sofa")).to_be_visible()
    expect(view.get_by_text("embedded common sense", exact=False)).to_be_visible()
    _drawn(page, tmp_path)


def test_the_camera_follows_the_growing_map_in_the_browser(growing, tmp_path):
    page = growing.page
    _drawn(page, tmp_path)

    def whole(picture):
        lit = _lit(picture)
        across, width = lit.any(axis=0).nonzero()[0], lit.shape[1]
        fills = len(across) and across[0] < 0.3 * width and across[-1] > 0.7 * width
        return fills and lit[:, 0].mean() < 0.2

    _shown(page, tmp_path, whole, "the whole map never came into the picture")


def test_the_colours_can_be_switched(growing, tmp_path):
    page, home = growing.page, growing.home
    home.frozen = True
    for _ in range(30):
        home.tick()
    before = _drawn(page, tmp_path)
    view = panels(page)
    open_tab(page, "Map")
    view.get_by_role("button", name="Proximity").click()
    expect(view.get_by_text("How near the object is likely to be")).to_be_visible()

    def blue(near):
        changed = (abs(near - before).max(axis=2) > 40).mean()
        return changed > 0.1 and (near[..., 2] > near[..., 0] + 40).mean() > 0.1

    _shown(page, tmp_path, blue, "walls and floor are far from a hat, and not blue")
    view.get_by_role("button", name="Object", exact=True).click()
    expect(view.get_by_text("Probability of the object")).to_be_visible()
    view.get_by_role("button", name="Camera", exact=True).click()


_TABS_WAIT = """let first;
Object.defineProperty(globalThis, "ipponMapFirst", {
    get: () => first,
    set: (value) => { first = Object.assign(value, { release: () => {} }); },
});"""
"""As on a slow machine: what comes after the map waits for long."""


def test_a_panel_for_developers_is_not_shown_before_the_tabs(growing):
    page = growing.window.new_page()
    page.add_init_script(_TABS_WAIT)
    page.goto(growing.console.url)
    theirs = panels(page).get_by_text("Scene tree")
    expect(theirs).to_be_attached()
    expect(theirs).to_be_hidden()
    expect(panels(page).get_by_role("tab")).to_have_count(0)
    page.close()


def test_a_find_is_shown_and_can_be_rejected(growing, stage):
    page, home = growing.page, growing.home
    home.begin_again()
    open_tab(page, "Search")
    home.find, home.state = stage.find_of(), "found"
    expect_state(page, "Found")
    view = panels(page)
    reject = view.get_by_role("button", name="Not this: keep looking")
    expect(reject).to_be_visible()
    expect(view.get_by_role("button", name="Confirm: this is it")).to_be_visible()
    reject.click()
    expect_state(page, "Searching")
    expect(reject).to_be_hidden()
    assert home.requests[-1] == (keys.FEEDBACK, b'{"verdict":"reject","goal_id":1}')
    _a_search_that_ends_without_a_find_lists_places(home, page)


def _a_search_that_ends_without_a_find_lists_places(home, page):
    view = panels(page)
    while home.ticks < 40:
        page.wait_for_timeout(200)
    home.state = "exhausted"
    expect_state(page, "Not found")
    expect(page.locator("#notice")).to_contain_text(
        "The robot has searched everything that it can reach"
    )
    expect(view.get_by_text("Most likely places")).to_be_visible()
    expect(view.get_by_text("most images show: sofa").first).to_be_visible()
    view.get_by_role("button", name="Look again").first.click()
    expect_state(page, "Searching")
    expect(view.get_by_role("button", name="Look again").first).to_be_hidden()
    # The place to look at follows the answer to the search.
    wait_until(page, lambda: [home.requests[-1][0]], keys.GOTO)
    again, goto = home.requests[-2:]
    assert again == (keys.QUEUE, encode(QueueRequest(goal_id=1, action="repeat")))
    assert b'"x_m":2.' in goto[1]


def test_a_page_opened_before_the_navigator_waits_for_it(early, stage, tmp_path):
    parts, page = early, early.open_page()
    expect_state(page, "Waiting")
    expect(page.locator("#veil")).to_contain_text(f"tcp/127.0.0.1:{parts.zenoh_port}")
    expect(page.locator("#veil-hint")).to_contain_text("ippon navigate")
    router = open_router(f"tcp/127.0.0.1:{parts.zenoh_port}")
    with starting(router, "ippon"):
        expect(page.locator("#veil")).to_contain_text("The navigator is starting")
        expect(page.locator("#veil")).to_contain_text("It compiles its program")
        expect(page.locator("#veil-hint")).to_be_empty()
    router.close()
    parts.home = stage.PublishedHome(parts.zenoh_port)
    expect_state(page, "Searching")
    expect(page.locator("#veil")).to_be_hidden()
    _drawn(page, tmp_path)


def test_the_page_comes_back_by_itself_when_the_console_does(growing, stage, tmp_path):
    parts, page = growing, growing.page
    parts.home.begin_again()
    _drawn(page, tmp_path)
    parts.console.kill()
    expect_state(page, "Disconnected")
    expect(page.locator("#veil")).to_contain_text("The console does not respond")
    page.locator("#stop").click()
    expect(page.locator("#notice")).to_contain_text("Not carried out")
    parts.console = stage.ConsoleProcess(parts.zenoh_port, parts.port)
    expect_state(page, "Searching")
    _drawn(page, tmp_path)
    expect(panels(page).get_by_text("going to the viewpoint")).to_be_visible()
