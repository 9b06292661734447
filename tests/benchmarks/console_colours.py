"""A map of 200,000 voxels in a real browser: its heap, a switch of colours, and frames in orbit."""

import itertools
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
_ORBIT_STEPS, _ORBIT_PX = 100, 3
"""Steps of the drag that turns the scene, and the length of each."""
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
  let draws = 0;
  for (const name of ["drawArrays", "drawElements", "drawElementsInstanced"]) {
    const draw = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...given) {
      draws += 1;
      draw.apply(this, given);
    };
  }
  // Once it is an array: [start, duration] of the page's part of every frame, in ms.
  window.frames = null;
  const request = requestAnimationFrame.bind(window);
  let [last, before] = [null, null];
  window.requestAnimationFrame = (draw) => request((time) => {
    const [start, drawn] = [performance.now(), draws];
    draw(time);
    if (window.frames) {
      if (draws > drawn) window.frames.push([start, performance.now() - start]);
      return;
    }
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
    console = ConsoleProcess(zenoh_port, free_port(), as_users=True)
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
            yield from _orbit(page, frame)
            window.close()
    finally:
        console.close()
        home.close()


def _orbit(page: Any, frame: Any) -> Iterator[Row]:
    """Turn the scene by a drag of the mouse."""
    page.mouse.move(400, 450)
    page.mouse.down()
    frame.evaluate("window.frames = []")
    for step in range(_ORBIT_STEPS):
        page.mouse.move(400 + _ORBIT_PX * step, 450)
    page.mouse.up()
    starts, took_ms = zip(*frame.evaluate("window.frames"), strict=True)
    apart_ms = [later - start for start, later in itertools.pairwise(starts)]
    data = f"{VOXELS} voxels"
    yield Row(name="console.orbit_frame", data=data, median_ms=statistics.median(took_ms))
    yield Row(name="console.orbit_interval", data=data, median_ms=statistics.median(apart_ms))


def _heap(page: Any, when: str) -> Row:
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")["usedSize"] / 1e6
    return Row(name="console.heap", data=f"{VOXELS} voxels, {when}", value=used, unit="MB")
