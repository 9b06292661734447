"""Data of a recording for exports."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from app.export.session_data import SessionData
from app.messages import keys
from app.recording.errors import RecordingError


@pytest.mark.parametrize(("found", "told"), [((keys.ODOM,), True), ((), False)])
def test_a_bag_without_tf_says_what_to_do_where_it_has_odometry(found, told):
    recording = SimpleNamespace(path=Path("a"), keys=found, all_messages=lambda _: ())
    session = SessionData(recording=recording, timeline=None, scene=None)
    with pytest.raises(RecordingError, match="no tf from map to base_link") as error:
        _ = session.trajectory
    assert ("ippon replay" in str(error.value)) is told


def test_a_session_is_named_by_its_folder_and_a_file_among_others_by_itself(tmp_path, monkeypatch):
    folder = tmp_path / "morning"
    folder.mkdir()
    (folder / "session_0.mcap").touch()

    def name_of(path):
        recording = SimpleNamespace(path=path)
        return SessionData(recording=recording, timeline=None, scene=None).name

    assert name_of(folder / "session_0.mcap") == "morning"
    monkeypatch.chdir(folder)
    assert name_of(Path("session_0.mcap")) == "morning"
    (folder / "other.mcap").touch()
    assert name_of(Path("other.mcap")) == "other.mcap"
