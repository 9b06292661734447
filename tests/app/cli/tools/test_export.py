import sys
from pathlib import Path

import numpy as np
import pytest

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
