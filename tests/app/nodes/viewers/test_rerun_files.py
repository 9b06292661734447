"""Files of Rerun: one for each session of the robot, and disks that are full."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("rerun", reason="needs the extra rerun")

import rerun as rr

from app.messages.body import BodyConfiguration, BodyProfile, BodySphere
from app.messages.images import StampedCamera
from app.messages.motion import robot_transforms
from app.messages.status import Event
from app.nodes.viewers import rerun_files, rerun_viewer
from app.nodes.viewers.errors import ViewerError
from app.nodes.viewers.rerun_scene import CAMERA, LOG, ROBOT_BODY, STATUS, TRAIL
from app.nodes.viewers.rerun_viewer import RerunConfig, RerunViewer
from app.view.model.scene_model import SceneModel
from ippon.camera import PinholeCamera
from ippon.geometry import make_transform
from tests.app.nodes.console.drawn_home import status_of

SECOND_NS = 1_000_000_000


@pytest.fixture
def model():
    """A robot that stands at 300 s, and was bumped at 290 s."""
    model = SceneModel()
    model.on_status(status_of(stamp_ns=300 * SECOND_NS))
    model.on_event(Event(stamp_ns=290 * SECOND_NS, kind="contact", text="an old bump"))
    return model


@pytest.fixture
def save(tmp_path, monkeypatch):
    """Draws into a file without pause; nothing is left open."""
    monkeypatch.setattr(rerun_viewer, "MAP_S", 0.0)
    monkeypatch.setattr(rerun_viewer, "CHECK_S", 0.0)
    viewer = RerunViewer(RerunConfig(save=tmp_path / "a.rrd"))
    yield viewer
    viewer.close()


def _chunks(path, entity):
    chunks = rr.chunk.RrdReader(path).stream()
    return [chunk for chunk in chunks if chunk.entity_path.removeprefix("/") == entity]


def _texts(path, entity):
    batches = [chunk.to_record_batch() for chunk in _chunks(path, entity)]
    columns = [b.column(n) for b in batches for n in b.schema.names if n.endswith(":text")]
    return [text for column in columns for (text,) in column.to_pylist()]


def _strips(path, entity):
    """Lines that were logged, without empty ones, in their order."""
    batches = [chunk.to_record_batch() for chunk in _chunks(path, entity)]
    columns = [b.column(n) for b in batches for n in b.schema.names if n.endswith(":strips")]
    return [strips[0] for column in columns for strips in column.to_pylist() if strips]


def test_a_clock_that_begins_again_begins_another_file(model, save, tmp_path):
    (tmp_path / "a-2.rrd").write_text("of somebody")
    save.draw(model, model.take_changes())
    model.on_status(status_of("paused", stamp_ns=2 * SECOND_NS))
    model.on_event(Event(stamp_ns=2 * SECOND_NS, kind="contact", text="a new bump"))
    save.draw(model, model.take_changes())
    save.close()
    first, second = tmp_path / "a.rrd", tmp_path / "a-3.rrd"
    assert "searching" in _texts(first, STATUS)[0]
    assert [text.split(":")[0].split("\n\n")[-1] for text in _texts(second, STATUS)] == ["paused"]
    assert (_texts(first, LOG), _texts(second, LOG)) == (["an old bump"], ["a new bump"])
    assert (tmp_path / "a-2.rrd").read_text() == "of somebody"


def test_a_navigator_that_is_started_again_alone_goes_on_in_the_file(model, save, tmp_path):
    save.draw(model, model.take_changes())
    for state, stamp_ns in (("starting", 0), ("paused", 301 * SECOND_NS)):
        model.on_status(status_of(state, stamp_ns=stamp_ns))
        save.draw(model, model.take_changes())
    assert not (tmp_path / "a-2.rrd").exists()
    for stamp_ns in (0, 2 * SECOND_NS):
        model.on_status(status_of(stamp_ns=stamp_ns))
        save.draw(model, model.take_changes())
    save.close()
    assert (tmp_path / "a-2.rrd").exists(), "with the robot"
    chunks = _chunks(tmp_path / "a.rrd", STATUS)
    assert all("robot_time" in chunk.to_record_batch().schema.names for chunk in chunks)


def test_what_comes_before_the_clock_is_seen_at_every_time(save, tmp_path):
    model = SceneModel()
    camera = PinholeCamera(fx=200.0, fy=200.0, cx=160.0, cy=120.0, width=320, height=240)
    model.on_camera(StampedCamera(stamp_ns=0, frame_id="camera", camera=camera))
    spheres = [BodySphere(x_m=0.0, y_m=0.0, z_m=0.2, radius_m=0.2)]
    profile = BodyProfile(name="round", spheres=spheres)
    model.on_configuration(BodyConfiguration(robot="ippon", profile=profile))
    save.draw(model, model.take_changes())
    save.close()
    path = tmp_path / "a.rrd"
    assert [chunk.is_static for chunk in _chunks(path, CAMERA)] == [True]
    assert [chunk.is_static for chunk in _chunks(path, f"{ROBOT_BODY}/body")] == [True]


def test_the_trail_of_a_robot_that_stands_is_written_once(model, save, tmp_path):
    for x in (0.0, 1.0, 1.0, 1.0):
        T_world_base = make_transform(np.eye(3), (x, 0.0, 0.0))
        model.on_transforms(robot_transforms(300 * SECOND_NS, T_world_base, np.eye(4)))
        save.draw(model, model.take_changes())
    save.close()
    assert len(_strips(tmp_path / "a.rrd", f"{TRAIL}/0")) == 1


def test_a_trail_is_written_in_pieces_that_meet(model, save, tmp_path):
    counts = (200, 257, 258, 700, 350)
    for count in counts:
        model.trail_world = [(float(n), 0.0, 0.0) for n in range(count)]
        save.draw(model, frozenset())
    save.close()
    path = tmp_path / "a.rrd"
    ends = [[(s[0][0], s[-1][0]) for s in _strips(path, f"{TRAIL}/{n}")] for n in range(3)]
    assert ends[0] == [(0, 199), (0, 256), (0, 256)], "a whole one is written once, and once anew"
    assert ends[1] == [(256, 257), (256, 512), (256, 349)]
    assert ends[2] == [(512, 699)]
    assert len(_chunks(path, TRAIL)) == 1, "the shorter one replaces all pieces"


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(ViewerError, match=r"cannot be written: Is a directory"):
        RerunViewer(RerunConfig(save=tmp_path))


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_disk_that_is_full_from_the_beginning_is_said():
    with pytest.raises(ViewerError, match=r"/dev/full cannot be written: .*No space left"):
        RerunViewer(RerunConfig(save=Path("/dev/full")))


def test_a_recording_ends_whole_before_its_disk_is_full(model, save, tmp_path, monkeypatch):
    save.draw(model, model.take_changes())
    usage = SimpleNamespace(free=rerun_files.LEAST_FREE - 1)
    monkeypatch.setattr(rerun_files.shutil, "disk_usage", lambda _: usage)
    with pytest.raises(ViewerError, match=r"a.rrd ends here: its disk has 64 MB left"):
        save.draw(model, frozenset())
    save.close()
    assert "searching" in _texts(tmp_path / "a.rrd", STATUS)[0]


def test_a_file_that_was_deleted_ends_the_command(model, save, tmp_path):
    save.draw(model, model.take_changes())
    (tmp_path / "a.rrd").unlink()
    with pytest.raises(ViewerError, match=r"a.rrd cannot be written any more, and is not"):
        save.draw(model, frozenset())
