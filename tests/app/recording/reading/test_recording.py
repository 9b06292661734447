"""Reading: any moment, in order, whole or cut off."""

import itertools
import struct

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from app.messages import keys
from app.recording.catalogue import list_sessions
from app.recording.channels import MARKERS_KEY
from app.recording.errors import RecordingError
from app.recording.reading import file_index
from app.recording.reading.recording import Recording
from app.recording.reading.repair import check
from app.recording.timeline import (
    TIMELINE_ATTACHMENT,
    SessionTimeline,
    pack_timeline,
    timeline_of,
    unpack_timeline,
)
from app.recording.writing.session import VERSIONS
from app.recording.writing.writer import SessionWriter
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap

START_NS = 1_750_000_000_000_000_000


@pytest.fixture
def recording(session_folder):
    recording = Recording(session_folder)
    yield recording
    recording.close()


def _ours(messages):
    return [(m.time_ns, m.key, m.payload) for m in messages if m.key != MARKERS_KEY]


def test_every_message_comes_back_as_it_was_in_order(recording, made_up):
    assert _ours(recording.all_messages()) == made_up.all_messages()
    assert recording.index.complete
    assert not recording.index.problems
    assert recording.duration_s == pytest.approx(5.8, abs=0.01)


def test_spans_neither_repeat_nor_leave_out(recording, made_up):
    whole = recording.end_ns - recording.start_ns + 1
    cuts = [recording.start_ns - 1 + whole * n // 13 for n in range(14)]
    parts = [message for a, b in itertools.pairwise(cuts) for message in recording.between(a, b)]
    assert _ours(parts) == made_up.all_messages()


def test_the_last_message_up_to_a_moment(recording, made_up):
    statuses = [(t, p) for t, k, p in made_up.all_messages() if k == keys.STATUS]
    t, payload = statuses[7]
    assert recording.latest(keys.STATUS, t).payload == payload
    assert recording.latest(keys.STATUS, t - 1).payload == statuses[6][1]
    assert recording.latest(keys.STATUS, recording.start_ns - 1) is None
    assert recording.latest("no/such", recording.end_ns) is None


def test_a_file_cut_anywhere_gives_what_came_before_the_cut(session_folder, made_up, tmp_path):
    whole = (session_folder / "session_0.mcap").read_bytes()
    expected = made_up.all_messages()
    recording = Recording(session_folder)
    first = recording.index.chunks[0].offset + recording.index.chunks[0].length
    recording.close()
    rng = np.random.default_rng(0)
    had = 0
    for size in sorted(rng.integers(0, len(whole), 40).tolist()):
        path = tmp_path / "cut.mcap"
        path.write_bytes(whole[:size])
        if size < first:
            with pytest.raises(RecordingError, match=r"cut.mcap"):
                Recording(path)
            continue
        recording = Recording(path)
        got = _ours(recording.all_messages())
        assert got == expected[: len(got)]
        assert len(got) >= had
        assert "not ended" in recording.index.problems[0]
        had = len(got)
        recording.close()
    assert had == len(expected)


def test_a_damaged_byte_costs_one_chunk_and_is_counted(session_folder, made_up, tmp_path):
    content = bytearray((session_folder / "session_0.mcap").read_bytes())
    recording = Recording(session_folder)
    chunk = max(recording.index.chunks, key=lambda chunk: chunk.length)
    recording.close()
    content[chunk.offset + chunk.length // 2] ^= 0xFF
    path = tmp_path / "damaged.mcap"
    path.write_bytes(content)
    damaged = Recording(path)
    got = _ours(damaged.all_messages())
    assert 0 < len(made_up.all_messages()) - len(got) < 120
    assert damaged.damaged.total() > 0
    damaged.close()


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", "not a recording"),
        (b"SQLite format 3\0" * 9, "is damaged: file is not a database"),
        (b"\x28\xb5\x2f\xfd" + bytes(9), r"thing.mcap is not a recording"),
        (b"\x89MCAP0\r\n", "no message"),
    ],
)  # fmt: skip
def test_files_that_are_no_recordings(content, text, tmp_path):
    path = tmp_path / "thing.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=text):
        Recording(path)


def test_a_folder_without_a_file_and_a_file_that_is_not_there(tmp_path):
    with pytest.raises(RecordingError, match=r"holds no .mcap or .db3 file"):
        Recording(tmp_path)
    with pytest.raises(RecordingError, match="there is no"):
        Recording(tmp_path / "none.mcap")


def test_a_bag_of_another_robot_is_read_by_the_ends_of_its_topics(tmp_path, made_up):
    path = tmp_path / "foreign.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.LZ4, use_chunking=True)
        writer.start(profile="ros2", library="other")
        schema = writer.register_schema("sensor_msgs/msg/CompressedImage", "ros2msg", b"")
        color = writer.register_channel(f"/spot/{keys.COLOR}", "cdr", schema)
        other = writer.register_channel("/spot/battery", "cdr", schema)
        # Time goes backwards in the middle.
        for n, t in enumerate([5, 6, 3, 4, 7]):
            writer.add_message(color, t, b"\0\1\0\0" + bytes([n]), t)
            writer.add_message(other, t, b"x", t)
        writer.finish()
    recording = Recording(path)
    assert recording.keys == (keys.COLOR,)
    assert [m.time_ns for m in recording.all_messages()] == [3, 4, 5, 6, 7]
    recording.close()


def test_unchunked_files_are_read(tmp_path):
    path = tmp_path / "loose.mcap"
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/Bool", "ros2msg", b"bool data")
        channel = writer.register_channel("/r/contact", "cdr", schema)
        writer.add_message(channel, 1, b"\0\1\0\0\1", 1)
        writer.finish()
    recording = Recording(path)
    assert [m.payload for m in recording.all_messages()] == [b"\0\1\0\0\1"]
    recording.close()


def test_the_timeline_in_the_file_is_the_one_that_reading_it_gives(recording):
    packed = recording.attachment(TIMELINE_ATTACHMENT)
    recording.index.attachments.clear()
    read = timeline_of(recording)
    assert read == unpack_timeline(packed)
    assert [mark.kind for mark in read.marks] == ["query", "detection", "levels", "found"]
    assert len(read.statuses) == 10
    assert read.last.state == "found"
    assert 0.5 < read.trail[-1].x < 0.6


def test_a_timeline_of_another_version_is_made_anew(recording):
    assert unpack_timeline(pack_timeline(SessionTimeline())) == SessionTimeline()
    with pytest.raises(RecordingError, match="timeline"):
        unpack_timeline(b"nonsense")


def test_a_file_that_is_being_written_is_followed_wherever_its_writer_is(session_folder, tmp_path):
    whole = (session_folder / "session_0.mcap").read_bytes()
    expected = Recording(session_folder)
    path = tmp_path / "growing.mcap"
    first = expected.index.chunks[0]
    sizes = np.random.default_rng(1).integers(first.offset + first.length, len(whole), 30)
    path.write_bytes(whole[: int(sizes.min())])
    growing = Recording(path)
    assert not growing.refresh()
    assert growing.index.problems
    for size in [*sorted(sizes.tolist()), len(whole)]:
        with path.open("ab") as file:
            file.write(whole[path.stat().st_size : size])
        growing.refresh()
        count = sum(len(entries.time_ns) for entries in growing.index.entries.values())
        assert count == len(list(growing.all_messages())), "each message once"
    assert growing.index.complete
    assert not growing.index.problems
    assert list(growing.all_messages()) == list(expected.all_messages())
    assert growing.attachment(TIMELINE_ATTACHMENT) == expected.attachment(TIMELINE_ATTACHMENT)
    assert not growing.refresh()
    growing.close()
    expected.close()


def test_of_a_file_that_grows_only_what_was_added_is_indexed(tmp_path, monkeypatch):
    writer = SessionWriter(tmp_path / "session", "r")

    def write(chunk):
        for n in range(5):
            writer.add(keys.STATUS, b"{}", 10**9 + 5 * chunk + n, 0.0)
        writer.flush()

    for chunk in range(200):
        write(chunk)
    growing = Recording(tmp_path / "session")
    indexed, from_buffer = [], np.frombuffer

    def counted(data, *args):
        if args == (file_index._ENTRY,):
            indexed.append(len(data))
        return from_buffer(data, *args)

    monkeypatch.setattr(np, "frombuffer", counted)
    for chunk in (200, 201):
        write(chunk)
        assert growing.refresh()
        assert len(growing.times_ns(keys.STATUS)) == 5 * (chunk + 1)
    assert indexed == 2 * [5 * file_index._ENTRY.itemsize]
    # What came late is put where it belongs.
    writer.add(keys.STATUS, b"{}", 10**9 + 900, 0.0)
    writer.close()
    assert growing.refresh()
    times = growing.times_ns(keys.STATUS)
    assert list(growing.index.entries.values())[-1].time_ns.tolist() == times.tolist()
    assert np.count_nonzero(times == 10**9 + 900) == 2
    growing.close()


def test_a_clock_that_was_set_back_is_told_of(made_up, tmp_path):
    session = made_up.write_session(tmp_path, seconds=2.0, end=False)
    for time_ns, key, payload in made_up.all_messages(2.0):
        now_s = 2.0 + (time_ns - made_up.START_NS) * 1e-9
        session.add(key, payload, time_ns - 3 * 10**9, now_s)
    session.close()
    recording = Recording(session.writer.folder)
    (problem,) = recording.index.problems
    assert "clock was set back by 4.8 s" in problem
    assert len(_ours(recording.all_messages())) == 2 * len(made_up.all_messages(2.0))
    recording.close()


def test_a_map_is_told_from_a_recording(tmp_path):
    VoxelMap(MapConfig(memory_limit_mb=64.0), ("wall",)).save(tmp_path / "home.map")
    with pytest.raises(RecordingError, match=r"is a map of `ippon navigate --map`"):
        Recording(tmp_path / "home.map")


def test_the_messages_of_two_topics_of_one_kind_are_read_as_one(tmp_path):
    with (tmp_path / "two.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("tf2_msgs/msg/TFMessage", "ros2msg", b"")
        one, other = (writer.register_channel(f"/{n}/tf", "cdr", schema) for n in "ab")
        for channel, time_ns in ((one, 10), (other, 5), (one, 20), (other, 30)):
            writer.add_message(channel, time_ns, bytes([time_ns]), time_ns)
        writer.finish()
    recording = Recording(tmp_path / "two.mcap")
    assert recording.first(keys.TF).payload == b"\x05"
    latest = [recording.latest(keys.TF, at) for at in (4, 9, 12, 29, 99)]
    assert [None if m is None else m.payload[0] for m in latest] == [None, 5, 10, 20, 30]
    recording.close()


@pytest.mark.parametrize(
    ("at", "value"), [("size", 2**31), ("offset", 2**63 + 5), ("time", 2**63 + 5)]
)
def test_a_damaged_index_costs_its_messages_and_hides_no_other_file(tmp_path, at, value):
    writer = SessionWriter(tmp_path / "s", "r")
    writer.note_metadata(VERSIONS, {"robot": "r"})
    for n in range(5):
        writer.add(keys.CONTACT, b"\0\1\0\0\1", START_NS + n, 0.0)
    writer.close()
    content = bytearray(writer.path.read_bytes())
    # The message index of the chunk: opcode, length, channel, size, then a time and an offset each.
    record = content.rindex(b"\x07" + (6 + 5 * 16).to_bytes(8, "little"))
    place, form = {"size": (11, "<I"), "time": (15, "<Q"), "offset": (23, "<Q")}[at]
    struct.pack_into(form, content, record + place, value)
    writer.path.write_bytes(content)
    recording = Recording(writer.path)
    left = [m.time_ns - START_NS for m in recording.all_messages()]
    assert left == {"size": [0, 1, 2, 3, 4], "offset": [1, 2, 3, 4], "time": [1, 2, 3, 4]}[at]
    # A size is cut to that of its record, so that nothing is lost.
    assert bool(recording.index.problems or recording.damaged) == (at != "size")
    recording.close()
    assert len(list_sessions(tmp_path)) == 1
    assert bool(check(writer.path, repair=True).problems) == (at != "size")
