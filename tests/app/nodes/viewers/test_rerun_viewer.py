"""Files of Rerun read back with its SDK, and a server of Rerun that comes and goes."""

import contextlib
import subprocess
import sys
import threading
import time
from importlib import resources

import numpy as np
import pytest

pytest.importorskip("rerun", reason="needs the extra rerun")

import rerun as rr

from app.messages import keys
from app.messages.control import encode
from app.messages.depth.depth_images import encode_depth, encode_depth_raw
from app.messages.status import Event
from app.nodes.viewers import rerun_viewer
from app.nodes.viewers.errors import ViewerError
from app.nodes.viewers.live_robot import LiveRobot
from app.nodes.viewers.rerun_scene import (
    CLOUDS,
    COLOR,
    DEPTH,
    FIGURES,
    FINDS,
    LOG,
    PLAN_PATH,
    ROBOT_BODY,
    STATUS,
    TRAIL,
    TREE,
    VIEWPOINTS,
)
from app.nodes.viewers.rerun_viewer import RerunConfig, RerunViewer
from app.view.colors import ooi_colors
from app.view.model.scene_model import SceneModel
from tests.app.nodes.console.drawn_home import status_of
from tests.ports import free_port

pytestmark = pytest.mark.process


class Rrd:
    """A recording of Rerun, read back."""

    def __init__(self, path):
        reader = rr.chunk.RrdReader(path)
        self.blueprints = len(reader.blueprints())
        self.chunks = {}
        for chunk in reader.stream():
            self.chunks.setdefault(chunk.entity_path.removeprefix("/"), []).append(chunk)

    def values(self, entity, component):
        """Values of a component of an entity, in order of robot time."""
        rows = []
        for chunk in self.chunks[entity]:
            if "robot_time" not in chunk.timeline_names:
                continue  # Drawn before the robot's clock was known.
            table = chunk.to_record_batch()
            (name,) = [n for n in table.schema.names if n.endswith(f":{component}")]
            times = table.column("robot_time").cast("int64").to_pylist()
            rows += zip(times, table.column(name).to_pylist(), strict=True)
        return [value for _, value in sorted(rows, key=lambda row: row[0])]

    def last_voxels(self, parent):
        """Centres and packed colours of the voxels of a map after the last message."""
        centers, colors = [], []
        for entity in self.chunks:
            if entity.startswith(f"{parent}/"):
                centers += self.values(entity, "positions")[-1] or []
                colors += self.values(entity, "colors")[-1] or []
        return np.array(centers), np.array(colors)


@pytest.fixture
def saved(tmp_path, start_home, show, wait, monkeypatch):
    """A home that was saved for a few seconds: its last map, and the recording."""
    monkeypatch.setattr(rerun_viewer, "DEPTH_S", 0.0)
    path = tmp_path / "robot.rrd"
    viewer = RerunViewer(RerunConfig(save=path))
    home = start_home()
    with show(viewer) as robot:
        wait(lambda: robot.model.voxels.count > 3000)
        home.put(keys.EVENT, encode(Event(stamp_ns=home.stamp_ns, kind="contact", text="a bump")))
        depth = np.full((20, 30), 1.25, np.float32)
        for key, payload in (
            (keys.DEPTH, encode_depth(depth, home.stamp_ns, "camera")),
            (keys.DEPTH_RAW, encode_depth_raw(depth, home.stamp_ns + 1, "camera")),
            (keys.DEPTH, b"damaged"),
        ):
            before = viewer._deep_at
            home.put(key, payload)
            wait(lambda before=before: viewer._deep_at > before)
        wait(lambda: robot.model.events)
        home.frozen = True
        # The home may be in the middle of a tick.
        keyframe, stamp_ns = home.keyframe(), None
        while stamp_ns != home.stamp_ns:
            stamp_ns, drawn = home.stamp_ns, viewer._mapped_at
            wait(lambda drawn=drawn: viewer._mapped_at > drawn + 1.0)
            keyframe = home.keyframe()
    viewer.close()
    return keyframe, Rrd(path)


def test_everything_is_in_the_file_and_the_map_is_that_of_the_robot(saved):
    keyframe, rrd = saved
    entities = {
        COLOR,
        DEPTH,
        ROBOT_BODY,
        TREE,
        VIEWPOINTS,
        PLAN_PATH,
        FINDS,
        STATUS,
        LOG,
        f"{TRAIL}/0",
    }
    assert entities | set(FIGURES) <= set(rrd.chunks)
    assert rrd.blueprints == 1
    low = np.floor(keyframe.centers_world[:, 2] / 0.1).astype(int) < 14
    for parent in CLOUDS:
        centers, _ = rrd.last_voxels(parent)
        assert len(centers) == np.count_nonzero(low)
        assert _rows(centers) == _rows(keyframe.centers_world[low])
    assert "searching" in rrd.values(STATUS, "text")[-1][0]
    assert "a bump" in [line for (line,) in rrd.values(LOG, "text")]
    assert "WARN" in [level for (level,) in rrd.values(LOG, "level")]
    assert len(rrd.values(DEPTH, "blob")) == 2
    best = [value for (value,) in rrd.values("search/best_match", "scalars")]
    assert best == sorted(best), "the figure of this home rises"
    kinds = {kind for (kind,) in rrd.values(COLOR, "media_type")}
    assert kinds == {"image/jpeg"}


def test_probabilities_have_the_colours_of_the_console(saved):
    keyframe, rrd = saved
    _, colors = rrd.last_voxels("world/map/probability")
    # Contact shadows darken a voxel by at most the shade; hue stays.
    brightest = {tuple(c) for c in ooi_colors(np.unique(keyframe.ooi)).tolist()}
    seen = {((int(c) >> 24) & 255, (int(c) >> 16) & 255, (int(c) >> 8) & 255) for c in colors}
    assert seen & brightest
    for color in seen:
        assert any(
            all(0.68 * b - 2 <= s <= b for s, b in zip(color, full, strict=True))
            for full in brightest
        )


def _rows(points):
    return {tuple(row) for row in np.round(np.asarray(points, np.float64), 3).tolist()}


@pytest.fixture(name="free_port")
def free_port_fixture():
    """A port for a viewer."""
    return free_port()


@pytest.fixture
def serve():
    """Starts servers of Rerun on a port; all are killed at the end."""
    binary = resources.files("rerun_cli") / "rerun"
    started = []

    def serve(at):
        command = [str(binary), "--serve-grpc", "--port", str(at), "--bind", "127.0.0.1"]
        started.append(
            subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        )
        return started[-1]

    yield serve
    for process in started:
        process.kill()
        process.wait()


COPY_S = 3.0
"""Time in which Rerun's program copies what a server holds; it does not say when it has."""
MOST_S = 30.0
"""What was not copied in less time never will be."""


def _fetch(port, path, is_whole):
    """Return what a server holds; a busy machine may need more time to copy all of it."""
    copy_s = COPY_S
    while copy_s < MOST_S:
        _copy(port, path, copy_s)
        # What was interrupted early is no file, or lacks entities.
        with contextlib.suppress(ValueError, KeyError, IndexError):
            if is_whole(rrd := Rrd(path)):
                return rrd
        copy_s *= 2.0
    raise AssertionError(f"not everything was copied within {copy_s / 2.0:g} s")


def _copy(port, path, copy_s):
    binary = resources.files("rerun_cli") / "rerun"
    url = f"rerun+http://127.0.0.1:{port}/proxy"
    command = [str(binary), url, "--save", str(path), "--port", "auto"]
    copying = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        time.sleep(copy_s)
        assert copying.poll() is None
        copying.terminate()
        copying.wait(10.0)
    finally:
        copying.kill()
        copying.wait()


@pytest.mark.filterwarnings("ignore:RRD file has no footer")  # The copy is interrupted.
def test_a_viewer_that_comes_late_and_comes_again_gets_everything(
    serve, start_home, show, wait, free_port, tmp_path, monkeypatch, caplog
):
    monkeypatch.setattr(rerun_viewer, "CHECK_S", 0.2)
    viewer = RerunViewer(RerunConfig(url=f"rerun+http://127.0.0.1:{free_port}/proxy"))
    caplog.set_level("INFO")
    home = start_home()
    with show(viewer) as robot:
        wait(lambda: robot.model.voxels.count > 500)
        wait(lambda: f"no viewer at rerun+http://127.0.0.1:{free_port}/proxy" in caplog.text)
        first = serve(free_port)
        wait(lambda: viewer._scene is not None)
        first.kill()
        first.wait()
        wait(lambda: viewer._scene is None)
        assert "does not receive any more" in caplog.text
        home.frozen = True
        serve(free_port)
        wait(lambda: viewer._scene is not None)
        count = np.count_nonzero(home.keyframe().centers_world[:, 2] < 1.4)
        rrd = _fetch(
            free_port,
            tmp_path / "copy.rrd",
            lambda rrd: len(rrd.last_voxels("world/map/proximity")[0]) == count,
        )
    viewer.close()
    assert STATUS in rrd.chunks, "published on change alone, before this viewer came"


def test_a_clock_that_begins_again_begins_another_recording_in_the_viewer(serve, wait, free_port):
    url = f"rerun+http://127.0.0.1:{free_port}/proxy"
    serve(free_port)
    wait(lambda: rerun_viewer._answers(url))
    viewer, model, recordings = RerunViewer(RerunConfig(url=url)), SceneModel(), []
    for stamp_ns in (10_000_000_000, 9_500_000_000, 1_000_000_000):
        model.on_status(status_of(stamp_ns=stamp_ns))
        viewer.draw(model, model.take_changes())
        recordings.append(viewer._stream.get_recording_id())
    viewer.close()
    assert recordings[0] == recordings[1] != recordings[2]


def test_a_file_that_cannot_be_written_is_said(tmp_path):
    with pytest.raises(ViewerError, match=r"missing/a.rrd cannot be written: No such file"):
        RerunViewer(RerunConfig(save=tmp_path / "missing" / "a.rrd"))


@pytest.mark.parametrize("url", ["http://127.0.0.1:9876", "rerun+http://", "rerun://host:99999"])
def test_an_address_of_no_viewer_is_refused(url):
    with pytest.raises(ValueError, match=r"is not the address of a viewer, such as rerun\+http"):
        RerunConfig(url=url)


def test_a_viewer_that_cannot_be_shown_is_an_error(port, free_port, start_home, monkeypatch):
    # A line that opens is closed at once; one that nobody answers takes seconds.
    start_home()
    monkeypatch.setattr(rerun_viewer, "PORT", free_port)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    viewer = RerunViewer(RerunConfig())
    with pytest.raises(ViewerError, match=r"has ended\. Without a display"):
        LiveRobot(f"tcp/127.0.0.1:{port}", "ippon").run(viewer, threading.Event())


def test_a_viewer_that_listens_for_a_moment_and_fails_is_an_error(
    port, free_port, start_home, monkeypatch
):
    start_home()
    monkeypatch.setattr(rerun_viewer, "PORT", free_port)
    monkeypatch.setattr(rerun_viewer, "CHECK_S", 0.2)
    listen = (
        f"import socket, time; _ = socket.create_server(('127.0.0.1', {free_port})); "
        "print(flush=True); time.sleep(2.0)"
    )
    command = [sys.executable, "-c", listen]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline()
        monkeypatch.setattr(rerun_viewer, "_answers", lambda _: False)
        monkeypatch.setattr(rerun_viewer, "start_viewer", lambda: process)
        viewer = RerunViewer(RerunConfig())
        monkeypatch.setattr(rerun_viewer, "_answers", lambda _: process.poll() is None)
        with pytest.raises(ViewerError, match=r"has ended\. Without a display"):
            LiveRobot(f"tcp/127.0.0.1:{port}", "ippon").run(viewer, threading.Event())


def test_closing_the_viewer_that_was_started_ends_the_command(
    serve, show, wait, free_port, monkeypatch
):
    monkeypatch.setattr(rerun_viewer, "PORT", free_port)
    monkeypatch.setattr(rerun_viewer, "CHECK_S", 0.2)
    monkeypatch.setattr(rerun_viewer, "_SHORT_S", 0.0)
    started = []
    start = lambda: started.append(serve(free_port)) or started[-1]  # noqa: E731
    monkeypatch.setattr(rerun_viewer, "start_viewer", start)
    viewer = RerunViewer(RerunConfig())
    with show(viewer):
        wait(lambda: viewer._scene is not None)
        started[0].kill()
        wait(lambda: viewer.closed)
        # It is drawn to until the command sees that.
        time.sleep(2.0 * rerun_viewer._RETRY_S)


def test_a_viewer_that_runs_already_is_used(serve, show, wait, free_port, monkeypatch):
    monkeypatch.setattr(rerun_viewer, "PORT", free_port)
    serve(free_port)
    wait(lambda: rerun_viewer._answers(f"rerun+http://127.0.0.1:{free_port}/proxy"))
    viewer = RerunViewer(RerunConfig())
    assert viewer._process is None
    with show(viewer):
        wait(lambda: viewer._scene is not None)
    viewer.close()
