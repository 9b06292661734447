"""Cut recordings are mended, and others left as they are."""

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from app.messages import keys
from app.recording.errors import RecordingError
from app.recording.reading import repair
from app.recording.reading.recording import Recording
from app.recording.reading.repair import check
from app.recording.timeline import TIMELINE_ATTACHMENT
from app.recording.writing.writer import SessionWriter
from tests.app.recording.conftest import with_two_odometries, write_bag


def _contents(folder):
    recording = Recording(folder)
    messages = list(recording.all_messages())
    attachments = set(recording.index.attachments)
    recording.close()
    return messages, attachments


def test_a_cut_session_is_mended_and_other_programs_open_it_again(tmp_path, made_up):
    session = made_up.write_session(tmp_path, end=False)
    session.writer.flush()
    session.writer.abandon()
    folder = session.writer.folder
    with session.writer.path.open("ab") as file:
        file.write(b"\x06\xff\xff\xff\0\0\0\0\0half a chunk")
    before, _ = _contents(folder)
    checkup = check(folder, repair=True)
    assert checkup.repaired
    assert checkup.kept == ""
    assert not checkup.complete
    assert "not ended" in checkup.problems[0]
    assert checkup.missing == ()
    after, attachments = _contents(folder)
    assert after == before
    assert TIMELINE_ATTACHMENT in attachments
    with session.writer.path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert sum(1 for _ in reader.iter_messages()) == len(before)
    with AnyReader([folder]) as reader:
        assert reader.message_count == len(before)
    again = check(folder, repair=True)
    assert again.complete
    assert not again.repaired
    assert list(folder.glob("*.partial")) == []


def _damaged(tmp_path, made_up, damage):
    """Return the folder of a session that was not ended, and its file with some bytes changed."""
    session = made_up.write_session(tmp_path, end=False)
    session.writer.flush()
    session.writer.abandon()
    recording = Recording(session.writer.folder)
    content = bytearray(session.writer.path.read_bytes())
    damage(content, recording.index.chunks[len(recording.index.chunks) // 2])
    recording.close()
    session.writer.path.write_bytes(content)
    return session.writer.folder, bytes(content)


def _change_content(content, chunk):
    content[chunk.offset + chunk.length // 2] ^= 0xFF


def _change_length(content, chunk):
    # The record's length stands before the chunk's header; no record behind it is found.
    content[content.rindex(b"\x06", 0, chunk.offset - 40) + 4] ^= 0xFF


@pytest.mark.parametrize("damage", [_change_content, _change_length])
def test_a_damaged_file_is_kept_beside_what_was_readable(tmp_path, made_up, monkeypatch, damage):
    monkeypatch.setattr(repair, "MOST_CUT_BYTES", 100)
    folder, content = _damaged(tmp_path, made_up, damage)
    checkup = check(folder, repair=True)
    assert checkup.repaired
    assert checkup.kept == "session_0.mcap.aside-1"
    assert (folder / checkup.kept).read_bytes() == content
    again = check(folder, repair=True)
    assert (again.complete, again.kept) == (True, "")
    assert again.messages == checkup.messages


def test_a_repair_without_room_on_the_disk_leaves_nothing_behind(tmp_path, made_up, monkeypatch):
    session = made_up.write_session(tmp_path, end=False)
    session.writer.flush()
    session.writer.abandon()
    cut = session.writer.path.read_bytes()

    def fill(_, target, __):
        target.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(repair, "_copy", fill)
    with pytest.raises(RecordingError, match="cannot be written: No space left"):
        check(session.writer.folder, repair=True)
    assert [path.name for path in session.writer.folder.iterdir()] == ["session_0.mcap"]
    assert session.writer.path.read_bytes() == cut


def test_a_session_that_is_still_recorded_is_not_replaced(tmp_path, made_up):
    session = made_up.write_session(tmp_path, end=False)
    session.writer.flush()
    checkup = check(session.writer.folder, repair=True)
    assert not checkup.repaired
    assert repair.STILL_WRITTEN in checkup.problems
    session.add(keys.EVENT, b"{}", session.start_ns + 10**10, 1e6)
    written = session.writer.messages
    session.close()
    assert len(_contents(session.writer.folder)[0]) == written
    assert repair.STILL_WRITTEN not in check(session.writer.folder, repair=True).problems


def test_where_no_lock_is_seen_a_session_that_grows_is_not_replaced(tmp_path, made_up, monkeypatch):
    monkeypatch.setattr(repair, "is_held", lambda _: False)
    session = made_up.write_session(tmp_path, end=False)
    session.writer.flush()
    inode, copy = session.writer.path.stat().st_ino, repair._copy

    def copy_slowly(*args):
        session.add(keys.EVENT, b"{}", session.start_ns + 10**10, 1e6)
        session.writer.flush()
        return copy(*args)

    monkeypatch.setattr(repair, "_copy", copy_slowly)
    checkup = check(session.writer.folder, repair=True)
    assert not checkup.repaired
    assert repair.STILL_WRITTEN in checkup.problems
    assert session.writer.path.stat().st_ino == inode
    assert list(session.writer.folder.glob("*.partial")) == []
    session.writer.abandon()


def test_a_whole_one_is_left_as_it_is_and_what_it_lacks_is_named(tmp_path, made_up):
    session = made_up.write_session(tmp_path / "a", end=False)
    session.close()
    content = session.writer.path.read_bytes()
    assert check(session.writer.folder, repair=True).complete
    assert session.writer.path.read_bytes() == content

    writer = SessionWriter(tmp_path / "b", "r")
    writer.add(keys.STATUS, b"{}", 1, 0.0)
    writer.close()
    assert keys.DEPTH in check(tmp_path / "b", repair=False).missing


def test_two_odometries_are_said_where_the_poses_would_be_those_of_one(tmp_path):
    both = with_two_odometries()
    checkup = check(write_bag(tmp_path / "two.mcap", both), repair=False, mount=True)
    assert "several topics that end in odom: /visual/odom, /wheels/odom" in checkup.problems[0]
    one = [message for message in both if message[0] != "/visual/odom"]
    assert not check(write_bag(tmp_path / "one.mcap", one), repair=False, mount=True).problems


def test_a_cut_file_of_another_program_is_not_rewritten(session_folder, tmp_path):
    whole = (session_folder / "session_0.mcap").read_bytes()
    path = tmp_path / "other.mcap"
    path.write_bytes(whole.replace(b"ippon/versions", b"other/versions")[:-2000])
    size = path.stat().st_size
    checkup = check(path, repair=True)
    assert not checkup.complete
    assert not checkup.repaired
    assert checkup.messages > 50
    assert repair.NOT_OURS in checkup.problems
    assert path.stat().st_size == size
