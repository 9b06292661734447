import shutil
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
from rich.progress import Progress

from app.cli.main import run
from app.cli.options.tools import Export
from app.cli.tools import export
from app.errors import UsageError
from app.export import video
from app.recording.errors import RecordingError
from ippon import extensions
from tests.app.recording.conftest import write_session


def test_without_a_video_encoder_the_rest_is_written(monkeypatch, capsys):
    monkeypatch.setattr(export, "can_write", lambda: False)
    names = export._writers(Export(recording=Path("x")))
    assert "map.ply" in names
    assert not any(name.endswith(".mp4") for name in names)
    assert 'pip install "ippon[video]"' in capsys.readouterr().err


def test_a_video_that_was_asked_for_says_what_it_needs(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "av", None)
    picture = (0.0, np.zeros((8, 8, 3), np.uint8))
    with pytest.raises(RecordingError, match=r"ippon\[video\]"):
        video._write(tmp_path / "x.mp4", iter([picture]), 1.0, print)
    assert list(export._writers(Export(recording=Path("x"), what=("camera",)))) == ["camera.mp4"]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_file_that_is_cut_off_leaves_the_earlier_one(tmp_path, error):
    path = tmp_path / "map.ply"
    path.write_text("whole", "utf-8")

    def fail(_, file, __):
        file.write_text("half", "utf-8")
        raise error

    with Progress(disable=True) as bar, pytest.raises(type(error)):
        export._write(None, path, fail, bar)
    assert [(file.name, file.read_text("utf-8")) for file in tmp_path.iterdir()] == [
        ("map.ply", "whole")
    ]


def fail(_, __):
    return {}["no such field"]


FAILS = ("fails.txt", fail)
WRITES_NOTHING = ("fails.txt", lambda _, __: None)
TAKES_OURS = ("map.ply", fail)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("no_such_module:EXPORT", "mine: 'mine' of ippon.exporters (no_such_module:EXPORT) cannot"),
        ("math:pi", "mine: 'mine' of ippon.exporters is no pair of a file's name and a callable"),
        (f"{__name__}:FAILS", "fails.txt: 'mine' of ippon.exporters has failed: KeyError: 'no suc"),
        (f"{__name__}:WRITES_NOTHING", "fails.txt: 'mine' of ippon.exporters wrote no file"),
        (f"{__name__}:TAKES_OURS", "mine: 'mine' of ippon.exporters writes map.ply, as another"),
    ],
)
def test_an_added_export_that_fails_is_named_and_the_others_are_written(
    tmp_path, monkeypatch, capsys, value, text
):
    point = EntryPoint("mine", value, extensions.EXPORTERS)
    monkeypatch.setattr(extensions, "entry_points", lambda **_: [point])
    writers = export._writers(Export(recording=Path("x")))
    assert "trajectory.tum" in writers
    (name,) = (name for name in writers if name in ("mine", "fails.txt"))
    with Progress(disable=True) as bar:
        assert not export._write(None, tmp_path / name, writers[name], bar)
    assert text in capsys.readouterr().out.replace("\n", " ")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("value", ["no_such_module:EXPORT", "math:pi"])
def test_an_added_export_that_is_asked_for_and_damaged_is_refused(monkeypatch, value):
    point = EntryPoint("mine", value, extensions.EXPORTERS)
    monkeypatch.setattr(extensions, "entry_points", lambda **_: [point])
    with pytest.raises(UsageError, match=r"'mine' of ippon\.exporters"):
        export._writers(Export(recording=Path("x"), what=("mine",)))


def test_an_added_export_that_is_asked_for_takes_the_place_of_none_of_ours(monkeypatch):
    point = EntryPoint("mine", f"{__name__}:TAKES_OURS", extensions.EXPORTERS)
    monkeypatch.setattr(extensions, "entry_points", lambda **_: [point])
    assert list(export._writers(Export(recording=Path("x"), what=("mine",)))) == ["map.ply"]
    with pytest.raises(UsageError, match=r"'mine' .* writes map\.ply, as another export does"):
        export._writers(Export(recording=Path("x"), what=("mine", "ply")))


def test_recordings_in_one_folder_are_exported_side_by_side(tmp_path):
    session = write_session(tmp_path / "session")
    bags = tmp_path / "bags"
    bags.mkdir()
    names = ("a.mcap", "b.mcap")
    for name in names:
        shutil.copy(session.writer.path, bags / name)
    for name in names:
        assert run(["export", str(bags / name), "tum"]) == 0
    assert sorted(path.parent.name for path in bags.rglob("*.tum")) == ["export-a", "export-b"]
