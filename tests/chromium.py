"""The browser of the tests, opened once and with patience: a renderer without a GPU is slow."""

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import (
    Browser,
    BrowserContext,
    FloatRect,
    Locator,
    Page,
    expect,
    sync_playwright,
)

from tests.browser import system_browser

GPU = "IPPON_TEST_GPU"
"""Set it to the arguments with which Chromium draws on this machine's GPU, for example
`--use-gl=angle --use-angle=vulkan --ignore-gpu-blocklist`."""
SOFTWARE = "--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
ARGUMENTS = [
    "--no-sandbox",
    *os.environ.get(GPU, SOFTWARE).split(),
    "--disable-background-networking",
    "--disable-dev-shm-usage",
]
CHEAP = ["--disable-gpu-compositing", "--webgl-antialiasing-mode=none"]
"""The page's layers are put together and its lines smoothed at a third of the processor's time; but
what lies over the scene cuts out its mirror image, too, which no picture should show."""
HUMBLE = Path(__file__).with_name("humble_browser")
"""Starts root's Chromium without the right to raise the priority of its drawing: without a GPU that
takes the processor's time from the tests and from what they test."""
KEEP_PICTURES = "IPPON_KEEP_PICTURES"
"""Set it to a folder to keep the pictures that tests take, with scenes in full resolution."""
SHARPNESS = 1.0 if KEEP_PICTURES in os.environ else 0.2
"""Pixels of a scene for each of the page's: with fewer, the rest of the page stays as it is, and so
do all places on the screen."""
UNDRAWN = """
if (location.pathname.endsWith("/view/")) {
  for (const context of [WebGLRenderingContext, WebGL2RenderingContext]) {
    for (const name of ["drawArrays", "drawElements"]) {
      for (const ending of ["", "Instanced"]) {
        if (context.prototype[name + ending]) context.prototype[name + ending] = () => {};
      }
    }
  }
}
"""
"""Leaves a scene empty: without a GPU its triangles take more of the processor than all else."""
_STOP = "**/api/stop*"
_LAID_OUT = """() => new Promise((done) => {
  setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(() => done())), 320);
})"""
"""Waits until the page has measured its scene, which it does every 300 ms, and has since drawn."""
PATIENCE_MS = 90_000
"""How long a thing may take to come about before it counts as missing, machine busy or not."""


@contextmanager
def open_browser(*, as_users: bool = KEEP_PICTURES in os.environ) -> Iterator[Browser]:
    """Yield Chromium, the system's or Playwright's own, without a window.

    Args:
        as_users: Draw as it does for users, whatever that costs.
    """
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        # Without a path Playwright takes its own headless shell.
        path = system_browser()
        env: dict[str, str | float | bool] = dict(os.environ)
        if path is not None and os.geteuid() == 0 and shutil.which("setpriv") is not None:
            env["IPPON_TEST_BROWSER"], path = path, str(HUMBLE)
        arguments = ARGUMENTS if as_users or GPU in os.environ else [*ARGUMENTS, *CHEAP]
        browser = playwright.chromium.launch(
            executable_path=path, args=arguments, timeout=PATIENCE_MS, env=env
        )
        yield browser
        browser.close()


def new_window(
    browser: Browser,
    width: int = 1440,
    height: int = 900,
    *,
    is_first_visit: bool = False,
    is_drawn: bool = KEEP_PICTURES in os.environ,
    sharpness: float | None = SHARPNESS,
) -> BrowserContext:
    """Return a window without pages; what one page loads is there for the next.

    Args:
        browser: Of `open_browser`.
        width: Of the page, pixels.
        height: Of the page, pixels.
        is_first_visit: Only a first visit meets the introduction.
        is_drawn: Scenes have their triangles, for tests that look at pixels.
        sharpness: Of scenes; None lets the page decide, as for users.
    """
    window = browser.new_context(viewport={"width": width, "height": height}, color_scheme="dark")
    window.set_default_timeout(PATIENCE_MS)
    if sharpness is not None:
        # A parameter of viser's client, there before the client reads its address.
        window.add_init_script(
            'if (location.pathname.endsWith("/view/"))'
            f'history.replaceState(null, "", `${{location.href}}&fixedDpr={sharpness}`);'
        )
    if not is_drawn:
        window.add_init_script(UNDRAWN)
    if not is_first_visit:
        window.add_init_script("localStorage.setItem('ippon-introduction', 'done')")
    return window


def new_page(
    browser: Browser,
    width: int = 1440,
    height: int = 900,
    *,
    is_drawn: bool = KEEP_PICTURES in os.environ,
) -> Page:
    """Return an empty page of a window of its own, which closes with the browser."""
    return new_window(browser, width, height, is_drawn=is_drawn).new_page()


@contextmanager
def each_stop_once(page: Page) -> Iterator[None]:
    """Let each press of Stop reach the console once.

    A page whose WebSocket does not answer within 0.7 s sends it over HTTP as well.
    """
    page.route(_STOP, lambda route: route.fulfill(json={"ok": True, "text": "stopped"}))
    try:
        yield
    finally:
        page.unroute(_STOP)


def boxes_at_rest(*locators: Locator) -> list[FloatRect]:
    """Return where elements of a page are, in pixels, once all are visible and none moves."""
    for locator in locators:
        expect(locator).to_be_visible()
    before: list[FloatRect | None] = []
    deadline = time.monotonic() + PATIENCE_MS / 1e3
    while True:
        boxes = [locator.bounding_box() for locator in locators]
        shown = [box for box in boxes if box is not None]
        if boxes == before and len(shown) == len(locators):
            return shown
        assert time.monotonic() < deadline, f"{locators} do not come to rest, last at {boxes}"
        before = boxes
        locators[0].page.evaluate(_LAID_OUT)


def box_at_rest(locator: Locator) -> FloatRect:
    """Return where an element is, in pixels, once it is visible and no longer moves."""
    (box,) = boxes_at_rest(locator)
    return box
