"""A map of 200,000 voxels in a real browser: its heap, and a switch of colours."""

import statistics
from collections.abc import Iterator
from typing import Any

import numpy as np

from tests.app.nodes.console.published_home import PublishedHome
from tests.app.nodes.console.served import ConsoleProcess
from tests.app.view.scenarios.test_view_benchmark import home_of
from tests.benchmarks.rows import Row
from tests.chromium import new_window, open_browser
from tests.ports import free_port

VOXELS = 200_000
MODES = ("Object", "Height", "Proximity", "Camera")
_DRAWN_MS = 25_000
_SWITCHED_MS = 4_000
_WATCH = """
(() => {
  const contexts = new Set();
  const get = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    const context = get.call(this, kind, ...more);
    if (kind === "webgl2" && context) contexts.add(context);
    return context;
  };
  // Pixels on a diagonal of the map; reading them waits for the renderer.
  const taken = () => {
    const gl = [...contexts].find((one) => one.canvas.isConnected);
    if (!gl) return null;
    const [wide, high] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    return Array.from({ length: 8 }, (_, n) => {
      const pixel = new Uint8Array(4);
      const [u, v] = [Math.round(wide * (0.29 + 0.04 * n)), Math.round(high * (0.21 + 0.06 * n))];
      gl.readPixels(u, v, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      return [...pixel.slice(0, 3)];
    }).flat();
  };
  const request = requestAnimationFrame.bind(window);
  let [last, before] = [null, null];
  window.requestAnimationFrame = (draw) => request((time) => {
    draw(time);
    last = taken();
    const others = before && last?.filter((value, n) => Math.abs(value - before[n]) > 25).length;
    if (others >= 6 && !window.switchedMs) window.switchedMs = performance.now() - window.pressedAt;
  });
  addEventListener("pointerdown", () => {
    [window.pressedAt, window.switchedMs, before] = [performance.now(), 0, last];
  }, true);
})();
"""


def colour_rows() -> Iterator[Row]:
    """Open a large map, and press the colours one after the other."""
    zenoh_port = free_port()
    home = PublishedHome(zenoh_port)
    home.frozen = True
    home._indices, home._order = home_of(VOXELS), np.arange(VOXELS)
    home._labels, home._shown = np.zeros(VOXELS, home._labels.dtype), VOXELS
    console = ConsoleProcess(zenoh_port, free_port())
    try:
        console.wait_until_up()
        with open_browser(as_users=True) as browser:
            window = new_window(browser, is_drawn=True, sharpness=None)
            window.add_init_script(_WATCH)
            page = window.new_page()
            page.goto(console.url)
            page.wait_for_timeout(_DRAWN_MS)
            yield _heap(page, "opened")
            view = page.frame_locator("#view")
            view.get_by_role("tab", name="Map", exact=True).click()
            page.wait_for_timeout(_SWITCHED_MS)
            frame = page.frame(url=lambda url: "/view/" in url)
            assert frame is not None
            switched_s: list[float] = []
            for mode in MODES:
                view.get_by_role("button", name=mode, exact=True).click()
                page.wait_for_timeout(_SWITCHED_MS)
                switched_s.append(frame.evaluate("window.switchedMs") / 1e3)
            if 0.0 in switched_s:
                raise TimeoutError(f"colours did not change within {_SWITCHED_MS} ms")
            for name, value in (
                ("median", statistics.median(switched_s)),
                ("longest", max(switched_s)),
            ):
                data = f"{VOXELS} voxels, {name}"
                yield Row(name="console.colour_switch_shown", data=data, value=value, unit="s")
            yield _heap(page, f"{len(MODES)} switches")
            window.close()
    finally:
        console.close()
        home.close()


def _heap(page: Any, when: str) -> Row:
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")["usedSize"] / 1e6
    return Row(name="console.heap", data=f"{VOXELS} voxels, {when}", value=used, unit="MB")
