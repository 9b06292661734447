"""What the recorder writes, read by programs that are not ours."""

import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from app.messages import keys
from app.messages.cdr import typestore
from app.recording.channels import MARKERS_KEY, STRING, decode_text, ros_name
from app.recording.errors import RecordingError
from app.recording.writing.writer import CHUNK_S, SessionWriter

MCAP = "session_0.mcap"


def test_rosbags_reads_every_message_with_its_type(session_folder, made_up):
    expected = {}
    for _, key, payload in made_up.all_messages():
        expected.setdefault(f"/home/_3/{key}", []).append(payload)
    seen = {}
    with AnyReader([session_folder]) as reader:
        for connection, time_ns, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            assert message.__msgtype__ == connection.msgtype
            text = connection.msgtype == STRING
            seen.setdefault(connection.topic, []).append(message.data.encode() if text else raw)
            assert time_ns >= made_up.START_NS
    markers = seen.pop(f"/home/_3/{MARKERS_KEY}")
    assert len(markers) == 6
    assert seen == expected


def test_the_bare_file_is_a_bag_too_and_names_our_types(session_folder):
    with AnyReader([session_folder / MCAP]) as reader:
        types = {connection.topic.removeprefix("/home/_3/"): connection.msgtype
                 for connection in reader.connections}  # fmt: skip
        assert "float32[] gains" in reader.typestore.generate_msgdef(types[keys.PLAN_TREE])[0]
    assert types[keys.COLOR] == "sensor_msgs/msg/CompressedImage"
    assert types[keys.MAP_VOXELS] == "sensor_msgs/msg/PointCloud2"
    assert types[keys.PLAN_PATH] == "nav_msgs/msg/Path"
    assert types[keys.TF] == "tf2_msgs/msg/TFMessage"
    assert types[MARKERS_KEY] == "visualization_msgs/msg/MarkerArray"


def test_mcap_finds_chunks_indexes_and_what_stands_beside_the_messages(session_folder):
    with (session_folder / MCAP).open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary.statistics.message_count == sum(1 for _ in reader.iter_messages())
        assert {index.compression for index in summary.chunk_indexes} == {"zstd"}
        assert reader.get_header().profile == "ros2"
        names = {attachment.name for attachment in reader.iter_attachments()}
        assert names == {
            "ippon/configuration.json", "ippon/digest.json.zst", "ippon/thumbnail.jpg",
        }  # fmt: skip
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    assert metadata["ippon/versions"]["robot"] == "home/3"
    assert metadata["ippon/summary"]["outcome"] == "found"
    assert metadata["ippon/summary"]["object"] == "hat"


@pytest.mark.slow
def test_rerun_loads_it(session_folder, tmp_path):
    rerun = Path(sys.executable).with_name("rerun")
    out = tmp_path / "session.rrd"
    for arguments in (
        ["mcap", "convert", session_folder / MCAP, "-o", out],
        ["rrd", "verify", out],
    ):
        done = subprocess.run([rerun, *arguments], capture_output=True, timeout=120, check=False)
        assert done.returncode == 0, done.stderr.decode()
    assert out.stat().st_size > 10_000


def test_the_bag_s_own_description(session_folder):
    content = yaml.safe_load((session_folder / "metadata.yaml").read_text())
    bag = content["rosbag2_bagfile_information"]
    counts = {entry["topic_metadata"]["name"]: entry["message_count"]
              for entry in bag["topics_with_message_count"]}  # fmt: skip
    assert counts["/home/_3/status"] == 30
    assert bag["message_count"] == sum(counts.values())
    hashes = {entry["topic_metadata"]["type_description_hash"][:7]
              for entry in bag["topics_with_message_count"]}  # fmt: skip
    assert hashes == {"RIHS01_"}


def test_a_chunk_is_closed_by_time_though_the_library_counts_bytes(tmp_path):
    writer = SessionWriter(tmp_path / "s", "r")
    writer.add(keys.STATUS, b"{}", 1, 0.0)
    size = writer.path.stat().st_size
    writer.flush_if_due(CHUNK_S - 0.01)
    assert writer.path.stat().st_size == size
    writer.flush_if_due(CHUNK_S)
    assert writer.path.stat().st_size > size
    writer.close()


def test_a_folder_is_never_written_over(tmp_path):
    SessionWriter(tmp_path / "s", "r").close()
    with pytest.raises(FileExistsError):
        SessionWriter(tmp_path / "s", "r")


def test_what_is_no_known_type_is_kept_as_text(tmp_path):
    payload = '{"é": 1}'.encode()
    writer = SessionWriter(tmp_path / "s", "r")
    writer.add("something/new", payload, 1, 0.0)
    writer.close()
    with AnyReader([tmp_path / "s"]) as reader:
        ((connection, _, raw),) = reader.messages()
        assert reader.deserialize(raw, connection.msgtype).data == payload.decode()
    assert decode_text(bytes(raw)) == payload


@pytest.mark.parametrize(
    "data", [b"", b"\0\1\0\0", b"\0\1\0\0\xff\0\0\0abc", b"\7\7\0\0\2\0\0\0a\0"]
)
def test_text_that_is_none_is_refused(data):
    with pytest.raises(RecordingError, match=r"std_msgs/String"):
        decode_text(data)


def test_names_of_topics_are_those_that_ros_accepts():
    assert ros_name("ippon/apartment-3-99/camera/x") == "/ippon/apartment_3_99/camera/x"
    assert ros_name("3/a.b") == "/_3/a_b"
    assert {"ippon_msgs/msg/Heatmap", "tf2_msgs/msg/TFMessage"} <= set(typestore().types)
