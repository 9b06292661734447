import numpy as np
import pytest

from ippon.segmentation.detectors.labels import labels_beside, read_labels_file
from ippon.segmentation.errors import CheckpointError


def test_a_line_is_a_class_with_optional_synonyms(tmp_path):
    path = tmp_path / "labels.txt"
    path.write_text("\ufeffcouch\n-\nhard hat = helmet, safety hat\nbackground\n\n", "utf-8")
    read = read_labels_file(path)
    assert read.classes == ("couch", "", "hard_hat", "")
    assert read.answers == (("couch", "sofa", "settee"), (), ("helmet", "safety_hat"), ())


def test_a_label_that_another_line_has_is_no_synonym(tmp_path):
    path = tmp_path / "labels.txt"
    path.write_text("cup\nblue cup = mug\ntv\nmonitor\ndining table\ndesk\n")
    read = read_labels_file(path)
    assert [answers[:2] for answers in read.answers] == [
        ("cup", "coffee_cup"), ("mug",), ("tv", "television"), ("monitor",),
        ("dining_table", "table"), ("desk",),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (None, "there is no labels file {path}"),
        (b"", "{path} holds no labels: it takes one name a line"),
        (b"\n \n", "{path} holds no labels: it takes one name a line"),
        (
            b"cup\n\ntv\n",
            "line 2 of {path} holds no name; '-' stands for an output without a class",
        ),
        (b"cup\ntv = \n", "line 2 of {path} says no label after '='"),
        (b"\xff\xfe\x00", "{path} is not a list of labels: it is not text"),
        (b"a" * 1_000_001, "{path} is not a list of labels: it is larger than 1000000 B"),
    ],
)
def test_files_without_a_list_are_rejected(tmp_path, content, text):
    path = tmp_path / "labels.txt"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(CheckpointError) as caught:
        read_labels_file(path)
    assert str(caught.value) == text.format(path=path)


def test_names_in_the_file_are_read_as_literals_alone(tmp_path):
    model = tmp_path / "y.onnx"
    read = labels_beside(model, {"names": "{0: 'cup', 2: 'tv'}"})
    assert read is not None
    assert read.classes == ("cup", "", "tv")
    made = tmp_path / "made"
    code = f"__import__('os').mkdir({str(made)!r})"
    text = r"y\.onnx has class names that are not a table: .__import__"
    with pytest.raises(CheckpointError, match=text):
        labels_beside(model, {"names": code})
    assert not made.exists()


@pytest.mark.parametrize(
    ("names", "text"),
    [
        ("'cup'", "names of classes are a table; got 'cup'"),
        ("{}", "names of classes are a table; got '{}'"),
        ("{'a': 'cup'}", "classes have numbers; got"),
        ("{-1: 'cup'}", "classes are numbered from 0 to 10000; got -1"),
        ("{10**9: 'cup'}", "has class names that are not a table"),
        ("{1000000000: 'cup'}", "classes are numbered from 0 to 10000; got 1000000000"),
    ],
)
def test_names_without_a_table_are_rejected(tmp_path, names, text):
    with pytest.raises(CheckpointError) as caught:
        labels_beside(tmp_path / "y.onnx", {"names": names})
    assert text in str(caught.value)


def test_numbers_in_place_of_names_say_nothing(tmp_path):
    said = {n: f"LABEL_{n}" for n in np.arange(3).tolist()}
    assert labels_beside(tmp_path / "y.onnx", {"names": str(said)}) is None
    (tmp_path / "metadata.yaml").write_text("names: {0: cup}\n")
    assert labels_beside(tmp_path / "y.onnx", {}) is None
    read = labels_beside(tmp_path / "y.param", {})
    assert read is not None
    assert read.classes == ("cup",)
