import sys
from pathlib import Path

import numpy as np
import pytest
from rich.progress import Progress

from app.cli.options.tools import Export
from app.cli.tools import export
from app.export import video
from app.recording.errors import RecordingError


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
