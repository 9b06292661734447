"""Files of every storage and compression of rosbag2: whole, split and cut off."""

import pytest
import yaml
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from app.messages import keys
from app.messages.cdr import typestore
from app.recording.errors import RecordingError
from app.recording.reading import stored_file
from app.recording.reading.file_index import Scanner
from app.recording.reading.recording import Recording
from app.recording.reading.repair import check
from app.recording.reading.stored_file import ChunkCache, unpack_message
from tests.app.recording.conftest import all_messages, write_session

WANTED = (keys.COLOR, keys.DEPTH, keys.CAMERA_INFO, keys.TF)
PARTS = 11
"""More than ten: in the order of the alphabet, the tenth would come before the second."""


def _split_bag(folder, storage="MCAP", mode="NONE", *, metadata=True):
    """Write a bag in parts, as `ros2 bag record --max-bag-size` does; return its messages."""
    messages = [(t, k, p) for t, k, p in all_messages() if k in WANTED]
    names = []
    folder.mkdir()
    for n in range(PARTS):
        part = folder / f"bag_{n}"
        writer = Writer(part, version=9, storage_plugin=StoragePlugin[storage])
        writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
        with writer:
            to = {
                key: writer.add_connection(f"/x/{key}", keys.ROS_TYPES[key], typestore=typestore())
                for key in WANTED
            }
            for time_ns, key, payload in _share(messages, n):
                writer.write(to[key], time_ns, payload)
        (part / "metadata.yaml").unlink()
        (file,) = part.iterdir()
        names.append(file.name)
        file.rename(folder / file.name)
        part.rmdir()
    if metadata:
        told = {"rosbag2_bagfile_information": {"relative_file_paths": names}}
        (folder / "metadata.yaml").write_text(yaml.safe_dump(told))
    return messages


def _share(messages, n):
    size = -(-len(messages) // PARTS)
    return messages[n * size : (n + 1) * size]


def _read(path):
    recording = Recording(path)
    try:
        return [(m.time_ns, m.key, m.payload) for m in recording.all_messages()], recording
    finally:
        recording.close()


@pytest.mark.parametrize("metadata", [True, False])
@pytest.mark.parametrize("mode", ["NONE", "FILE", "MESSAGE"])
@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
def test_the_parts_of_a_bag_are_read_as_one(tmp_path, monkeypatch, storage, mode, metadata):
    unpacked = tmp_path / "unpacked"
    unpacked.mkdir()
    monkeypatch.setattr(stored_file.tempfile, "tempdir", str(unpacked))
    written = _split_bag(tmp_path / "bag", storage, mode, metadata=metadata)
    read, recording = _read(tmp_path / "bag")
    assert read == written
    assert not recording.index.problems
    assert recording.index.complete
    assert not recording.damaged
    assert not list(unpacked.iterdir()), "what was unpacked is removed"


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
def test_any_moment_of_a_bag_in_parts(tmp_path, storage):
    written = _split_bag(tmp_path / "bag", storage)
    recording = Recording(tmp_path / "bag")
    colors = [(t, p) for t, k, p in written if k == keys.COLOR]
    for time_ns, payload in colors[::7]:
        assert recording.latest(keys.COLOR, time_ns).payload == payload
    assert recording.latest(keys.COLOR, colors[0][0] - 1) is None
    assert recording.first(keys.COLOR).payload == colors[0][1]
    half = written[len(written) // 2][0]
    after = [m.time_ns for m in recording.between(half, recording.end_ns)]
    assert after == [t for t, _, _ in written if t > half]
    recording.close()


def test_a_bag_whose_recorder_was_killed_is_read_as_far_as_it_goes(tmp_path):
    folder = tmp_path / "bag"
    written = _split_bag(folder, metadata=False)
    last = folder / f"bag_{PARTS - 1}.mcap"
    last.write_bytes(last.read_bytes()[:-700])
    read, recording = _read(folder)
    assert read == written[: len(read)]
    assert len(read) >= len(written) - len(_share(written, PARTS - 1))
    assert any(
        text.startswith(f"{last.name}: the file was not") for text in recording.index.problems
    )
    assert not recording.index.complete
    assert not check(folder, repair=True).repaired
    last.write_bytes(b"")
    read, recording = _read(folder)
    assert len(read) == len(written) - len(_share(written, PARTS - 1))
    assert any("is not a recording" in text for text in recording.index.problems)


def test_a_part_that_is_missing_is_named(tmp_path):
    written = _split_bag(tmp_path / "bag")
    (tmp_path / "bag" / "bag_3.mcap").unlink()
    read, recording = _read(tmp_path / "bag")
    assert read == [one for n in range(PARTS) if n != 3 for one in _share(written, n)]
    (problem,) = recording.index.problems
    assert problem.endswith("bag_3.mcap: No such file or directory")


def test_what_is_written_while_a_file_is_opened_is_read_then(tmp_path, monkeypatch):
    session = write_session(tmp_path, seconds=2.0, end=False)
    session.writer.flush()
    scan = Scanner.scan

    def slow(scanner, progress=None):
        index = scan(scanner, progress)
        if not session.writer._file.closed:
            session.close()
        return index

    monkeypatch.setattr(Scanner, "scan", slow)
    recording = Recording(session.writer.folder)
    assert not recording.index.complete
    assert recording.refresh()
    assert recording.index.complete
    assert not recording.refresh()
    recording.close()


def test_sqlite_that_is_cut_off_is_an_error(tmp_path):
    _split_bag(tmp_path / "bag", "SQLITE3")
    path = tmp_path / "bag" / "bag_0.db3"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(RecordingError, match=r"bag_0.db3 is damaged: .*malformed"):
        Recording(path)


def test_chunks_beyond_the_limit_are_forgotten(tmp_path, monkeypatch):
    monkeypatch.setattr(stored_file, "CACHE_BYTES", 100)
    cache, unpacked = ChunkCache(), []

    def get(name, number):
        return cache.get(tmp_path / name, number, lambda: unpacked.append(number) or bytes(40))

    for number in (0, 1, 0, 2, 0):
        get("a", number)
    assert unpacked == [0, 1, 2]
    get("b", 7)
    get("a", 2)
    assert unpacked == [0, 1, 2, 7, 2], "the limit is that of all files together"


def test_a_damaged_compressed_message_is_an_error():
    assert unpack_message(b"\0\1\0\0x") == b"\0\1\0\0x"
    with pytest.raises(RecordingError, match="a compressed message is damaged"):
        unpack_message(stored_file.ZSTD_MAGIC + b"nonsense")
