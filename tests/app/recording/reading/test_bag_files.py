"""Which files are one recording, and in which order."""

import pytest
import yaml

from app.recording.errors import RecordingError
from app.recording.reading.bag_files import files_of, is_one_bag


def _folder(tmp_path, names, told=None):
    for name in names:
        (tmp_path / name).write_bytes(b"")
    if told is not None:
        content = {"rosbag2_bagfile_information": {"relative_file_paths": told}}
        (tmp_path / "metadata.yaml").write_text(yaml.safe_dump(content))
    return tmp_path


@pytest.mark.parametrize(
    ("names", "told", "expected"),
    [
        (["walk.mcap"], None, ["walk.mcap"]),
        (["walk.mcap"], ["session_0.mcap"], ["walk.mcap"]),  # renamed
        (["b_10.db3", "b_2.db3", "b_0.db3"], None, ["b_0.db3", "b_2.db3", "b_10.db3"]),
        (["b_10.mcap", "b_9.mcap"], ["b/b_9.mcap", "b/b_10.mcap"], ["b_9.mcap", "b_10.mcap"]),
        (["x.mcap", "y.mcap"], ["y.mcap", "x.mcap"], ["y.mcap", "x.mcap"]),
        # A part that is missing is named by the reader.
        (["b_0.mcap"], ["b_0.mcap", "b_1.mcap"], ["b_0.mcap", "b_1.mcap"]),
        # The last part of a recorder that was killed is not compressed, and there is no metadata.
        (["b_0.mcap.zstd", "b_1.mcap"], None, ["b_0.mcap.zstd", "b_1.mcap"]),
        # It was killed while it compressed one: that is still there as it was.
        (["b_0.mcap", "b_0.mcap.zstd"], None, ["b_0.mcap"]),
        (
            ["b_0.mcap.zstd", "b_1.mcap", "b_1.mcap.zstd"],
            None,
            ["b_0.mcap.zstd", "b_1.mcap"],
        ),
        (["0.mcap", "1.mcap"], [], ["0.mcap", "1.mcap"]),
    ],
)
def test_the_parts_of_a_bag_by_its_metadata_or_their_names(tmp_path, names, told, expected):
    folder = _folder(tmp_path, names, told)
    assert [file.name for file in files_of(folder)] == expected
    assert is_one_bag(folder)


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (["a.mcap", "b.mcap"], None),
        (["a_0.mcap", "b_1.mcap"], None),
        (["a_0.mcap", "a_0.db3"], None),
        (["session_0.mcap", "part_1.mcap"], ["session_0.mcap"]),
    ],
)
def test_files_that_are_not_parts_of_one_bag_are_not_joined(tmp_path, names, told):
    folder = _folder(tmp_path, names, told)
    assert not is_one_bag(folder)
    with pytest.raises(RecordingError, match=r"holds 2 recordings, .*: name one of them"):
        files_of(folder)


@pytest.mark.parametrize("text", ["", "[", "rosbag2_bagfile_information: 3", "\0", "[" * 600])
def test_metadata_that_cannot_be_read_is_not_used(tmp_path, text):
    folder = _folder(tmp_path, ["b_1.mcap", "b_0.mcap"])
    (folder / "metadata.yaml").write_text(text)
    assert [file.name for file in files_of(folder)] == ["b_0.mcap", "b_1.mcap"]
