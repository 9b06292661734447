"""Lists of sessions."""

import io
import shutil

import msgspec
import pytest
import zstandard
from PIL import Image

from app.messages import keys
from app.messages.control import encode
from app.messages.status import GoalStatus
from app.recording import catalogue, timeline
from app.recording.catalogue import (
    is_folder_of_recordings,
    list_sessions,
    path_of,
    picture_of,
)
from app.recording.errors import RecordingError
from app.recording.reading.recording import Recording
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import SUMMARY, Session


def test_a_session_in_a_list(session_folder):
    root = session_folder.parent
    (entry,) = list_sessions(root)
    assert entry.id == f"{session_folder.name}/session_0.mcap"
    assert (entry.object, entry.context, entry.outcome) == ("hat", "on the sofa", "found")
    assert entry.robot == "home/3"
    picture = picture_of(root, entry.id, [entry])
    assert Image.open(io.BytesIO(picture)).size == (64, 40)
    assert picture_of(root, "../secret.mcap", [entry]) is None
    (root / entry.id).write_bytes(b"changed since")
    assert picture_of(root, entry.id, [entry]) is None
    assert path_of(root, entry.id, [entry]) == root / entry.id
    assert path_of(root, "../secret.mcap", [entry]) is None


def test_a_folder_of_several_recordings_is_listed_and_not_read_as_its_first(session_folder):
    assert not is_folder_of_recordings(session_folder)
    assert is_folder_of_recordings(session_folder.parent)
    file = session_folder / "session_0.mcap"
    assert not is_folder_of_recordings(file)
    Recording(session_folder).close()
    shutil.copy(file, session_folder / "part_1.mcap")
    assert is_folder_of_recordings(session_folder)
    with pytest.raises(RecordingError, match=r"part_1.mcap, session_0.mcap: name one"):
        Recording(session_folder)


def test_a_bag_in_a_folder_is_one_recording_whatever_its_parts_and_its_format(session_folder):
    root, file = session_folder.parent, session_folder / "session_0.mcap"
    (root / "split").mkdir()
    for n in range(3):
        shutil.copy(file, root / "split" / f"split_{n}.mcap")
    (root / "packed").mkdir()
    packed = zstandard.compress(file.read_bytes())
    (root / "packed" / "packed_0.mcap.zstd").write_bytes(packed)
    (root / "sqlite").mkdir()
    (root / "sqlite" / "sqlite_0.db3").write_bytes(b"no database")
    (root / "others").mkdir()
    for name in ("morning.mcap", "evening.mcap"):
        shutil.copy(file, root / "others" / name)
    entries = {entry.id: entry for entry in list_sessions(root)}
    assert set(entries) == {
        f"{session_folder.name}/session_0.mcap", "split", "packed", "sqlite",
        "others/morning.mcap", "others/evening.mcap",
    }  # fmt: skip
    assert entries["split"].object == entries["packed"].object == "hat"
    assert entries["split"].size == 3 * file.stat().st_size
    assert entries["sqlite"].problem
    Recording(path_of(root, "split", list(entries.values()))).close()
    assert picture_of(root, "split", list(entries.values())) is None


def test_a_bag_that_gets_another_part_is_read_again(session_folder, monkeypatch):
    root, file = session_folder.parent, session_folder / "session_0.mcap"
    (root / "split").mkdir()
    for n in range(2):
        shutil.copy(file, root / "split" / f"split_{n}.mcap")
    list_sessions(root)
    reads = []
    read = catalogue._read
    monkeypatch.setattr(catalogue, "_read", lambda *a: reads.append(a) or read(*a))
    list_sessions(root)
    assert reads == []
    shutil.copy(file, root / "split" / "split_2.mcap")
    list_sessions(root)
    assert [one[1] for one in reads] == ["split"]


def test_a_link_to_a_file_that_is_gone_hides_no_session(session_folder):
    (session_folder / "old.mcap").symlink_to(session_folder / "none.mcap")
    entries = list_sessions(session_folder.parent)
    assert [entry.id for entry in entries] == [f"{session_folder.name}/session_0.mcap"]


def test_broken_files_are_listed_with_what_is_wrong(tmp_path, made_up):
    cut = made_up.write_session(tmp_path, end=False)
    cut.writer.flush()
    cut.writer.abandon()
    (tmp_path / "other.mcap").write_bytes(b"nonsense")
    entries = {entry.id: entry for entry in list_sessions(tmp_path)}
    assert "not a recording" in entries["other.mcap"].problem
    (whole,) = (entry for name, entry in entries.items() if name != "other.mcap")
    assert (whole.object, whole.outcome, whole.problem) == ("hat", "found", "")


@pytest.mark.slow
def test_a_thousand_sessions_are_read_once(session_folder, monkeypatch):
    root = session_folder.parent
    for n in range(999):
        folder = root / f"copy-{n}"
        folder.mkdir()
        (folder / "session_0.mcap").hardlink_to(session_folder / "session_0.mcap")
    assert len(list_sessions(root)) == 1000
    reads = []
    read = catalogue._read
    monkeypatch.setattr(catalogue, "_read", lambda *a: reads.append(a) or read(*a))
    assert len(list_sessions(root)) == 1000
    assert reads == []
    shutil.rmtree(root / "copy-7")
    assert len(list_sessions(root)) == 999


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(RecordingError, match="there is no folder"):
        list_sessions(tmp_path / "none")


def test_a_session_of_several_searches_is_found_by_each_of_them(tmp_path, made_up):
    session = made_up.write_session(tmp_path, end=False)
    ended = made_up.status_of(40, "found")
    tables = GoalStatus(goal_id=7, object="dining_table", display="tables", outcome="active")
    before = GoalStatus(goal_id=9, object="tv", outcome="found")
    later = msgspec.structs.replace(ended, goal=tables, history=[before, ended.goal])
    session.add(keys.STATUS, encode(later), made_up.START_NS + 8 * 10**9, 8.0)
    session.close()
    (entry,) = list_sessions(tmp_path)
    assert [(goal.object, goal.context, goal.outcome) for goal in entry.goals] == [
        ("hat", "on the sofa", "found"),
        ("tables", "", "unfinished"),
    ]
    assert entry.duration_s == pytest.approx(8.0)


def test_the_time_before_the_first_message_is_no_part_of_a_session(session_folder):
    recording = Recording(session_folder)
    summary = recording.index.metadata[SUMMARY]
    recording.close()
    assert float(summary["duration_s"]) == pytest.approx(5.8, abs=0.1)


def test_of_a_session_that_is_being_recorded_every_other_second_is_read(
    made_up, tmp_path, monkeypatch
):
    session = made_up.write_session(tmp_path, 12.0, end=False)
    session.writer.flush()
    read = []
    decoded = timeline.decoded
    monkeypatch.setattr(timeline, "decoded", lambda *args: read.append(args) or decoded(*args))
    (growing,) = list_sessions(tmp_path)
    assert len(read) < 20
    assert [goal.outcome for goal in growing.goals] == ["found"]
    session.writer.abandon()
    (tmp_path / ".ippon-sessions.json").unlink()
    (cut,) = list_sessions(tmp_path)
    assert len(read) > 100
    assert cut.goals == growing.goals
    assert growing.path_length_m == pytest.approx(cut.path_length_m, abs=0.1)


def test_a_list_reads_no_more_of_an_hour_that_is_being_recorded(made_up, tmp_path, monkeypatch):
    session = Session(tmp_path, "home/3", RecordingLimits(min_free_gb=0.0), made_up.START_NS)
    poses = [payload for key, payload in made_up.messages_of(0, 1) if key == keys.TF]
    for second in range(0, 3600, 2):
        at_ns = made_up.START_NS + second * 10**9
        session.add(keys.TF, poses[0], at_ns, float(second))
        session.add(keys.STATUS, encode(made_up.status_of(5 * second)), at_ns + 1, float(second))
    session.writer.flush()
    read, decoded = [], timeline.decoded
    monkeypatch.setattr(timeline, "decoded", lambda *args: read.append(args) or decoded(*args))
    (growing,) = list_sessions(tmp_path)
    assert growing.duration_s == pytest.approx(3598.0)
    assert [goal.object for goal in growing.goals] == ["hat"]
    assert 500 <= len(read) < 1100
    session.writer.abandon()
