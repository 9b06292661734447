"""The page opened in a real browser, and what the console pays for changes and colours."""

import contextlib
import io
import os
import statistics
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import viser

from app.view.drawing.viser_scene import ALL_PARTS, ViserScene
from app.view.model.scene_model import SceneModel
from app.view.view_options import ViewOptions
from tests.app.nodes.console.drawn_home import status_of
from tests.app.nodes.console.published_home import PublishedHome
from tests.app.nodes.console.served import ConsoleProcess
from tests.app.view.scenarios.test_view_benchmark import cloud_of_home, home_of, sent_by, view_of
from tests.benchmarks.rows import Row
from tests.chromium import open_browser
from tests.ports import free_port

OPENINGS = 5
SIZES = (20_000, 200_000)
_HZ = os.sysconf("SC_CLK_TCK")
_DRAWN_POINTS = 8000
"""Of the drawn home's 15,600 voxels, what is below the cut: the map is there."""
_WATCH = """
(() => {
  let points = 0, frame = 0;
  for (const name of ["drawArrays", "drawArraysInstanced"]) {
    const draw = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...given) {
      draw.apply(this, given);
      if (window.drawnAt) return;
      if (!frame) frame = requestAnimationFrame(() => { frame = 0; points = 0; });
      if (given[0] === this.POINTS || name === "drawArraysInstanced") {
        points += given[2] * (given[3] ?? 1);
      }
      if (points < %d) return;
      window.drawnAt = -1;
      setTimeout(() => {
        // Waits for the renderer.
        this.readPixels(0, 0, 1, 1, this.RGBA, this.UNSIGNED_BYTE, new Uint8Array(4));
        window.drawnAt = performance.timeOrigin + performance.now();
      });
    };
  }
})();
"""


def page_rows() -> Iterator[Row]:
    """Open the page of a drawn home, a fresh profile each time, until its map is drawn."""
    # A browser has all cores.
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    zenoh_port = free_port()
    home = PublishedHome(zenoh_port)
    console = ConsoleProcess(zenoh_port, free_port(), as_users=True)
    try:
        console.wait_until_up()
        for _ in range(30):
            home.tick()
        home.frozen = True
        with open_browser(as_users=True) as browser:
            for n in range(OPENINGS + 1):
                yield from _opened(browser, console, "new browser" if n == 0 else f"opening {n}")
    finally:
        console.close()
        home.close()


def _opened(browser: Any, console: Any, data: str) -> Iterator[Row]:
    context = browser.new_context(viewport={"width": 1440, "height": 900}, color_scheme="dark")
    context.add_init_script(_WATCH % _DRAWN_POINTS)
    page = context.new_page()
    page.goto("about:blank")
    before, own, began = _browser_s(), _used_s(console.process.pid), time.time()
    page.goto(console.url, wait_until="commit")
    drawn_at = -1.0
    while drawn_at <= 0.0:
        page.wait_for_timeout(20)
        frame = page.frame(url=lambda url: "/view/" in url)
        if frame is not None:
            with contextlib.suppress(Exception):
                drawn_at = frame.evaluate("window.drawnAt ?? -1")
        if time.time() - began > 120.0:
            raise TimeoutError("the map is not drawn after two minutes")
    yield Row(name="console.first_picture", data=data, value=drawn_at / 1e3 - began, unit="s")
    used = _browser_s() - before
    yield Row(name="console.first_picture_browser", data=data, value=used, unit="s of a core")
    used = _used_s(console.process.pid) - own
    yield Row(name="console.first_picture_console", data=data, value=used, unit="s of a core")
    context.close()


def _browser_s() -> float:
    """Return the processor time of everything that runs below this process and is a browser."""
    parents = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            stat = (folder / "stat").read_text()
            name = stat[stat.index("(") + 1 : stat.rindex(")")]
            parents[int(folder.name)] = (int(stat.rpartition(")")[2].split()[1]), name)
    ours, total = {os.getpid()}, 0.0
    for pid in sorted(parents):
        parent, name = parents[pid]
        if parent in ours:
            ours.add(pid)
            total += _used_s(pid) if "chrom" in name.lower() else 0.0
    return total


def _used_s(pid: int) -> float:
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / _HZ


def drawing_rows() -> Iterator[Row]:
    """Measure the console's part of a keyframe, a switch of colours and a change."""
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        for voxels in SIZES:
            yield from _drawn(server, voxels)
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _drawn(server: Any, voxels: int) -> Iterator[Row]:
    indices, data = home_of(voxels), f"{voxels} voxels"
    model, scene = SceneModel(), ViserScene(server)
    model.on_status(status_of())

    def draw(mode: Any = "camera") -> None:
        scene.draw(model, model.take_changes(), ViewOptions(mode=mode))

    def load() -> None:
        model.on_keyframe(cloud_of_home(indices, 1, 0))
        scene.draw(model, ALL_PARTS, ViewOptions())

    yield from _timed("keyframe", data, [load])
    switches = [lambda mode=mode: draw(mode) for mode in ("ooi", "proximity", "height", "camera")]
    yield from _timed("colour_mode", data, switches)
    seen = view_of(indices)

    def change(n: int) -> None:
        model.on_voxels(cloud_of_home(seen, n, n))
        draw()

    yield from _timed("change_of_2000", data, [lambda n=n: change(n) for n in range(2, 12)])
    kilobytes = sent_by(server, lambda: change(20))[1] / 1e3
    yield Row(name="console.change_of_2000", data=data, value=kilobytes, unit="kB a browser")


def _timed(name: str, data: str, calls: list[Any]) -> Iterator[Row]:
    elapsed, used = [], []
    for call in calls:
        began, thread_began = time.perf_counter(), time.thread_time()
        call()
        elapsed.append(time.perf_counter() - began)
        used.append(time.thread_time() - thread_began)
    name = f"console.{name}"
    yield Row(name=name, data=data, median_ms=1e3 * statistics.median(elapsed))
    yield Row(name=name, data=data, value=1e3 * statistics.median(used), unit="ms of a core")
