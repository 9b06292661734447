import numpy as np
import pytest
from PIL import Image

from ippon.segmentation.detectors.nanodet import NanoDetSegmenter, distinct
from ippon.segmentation.errors import CheckpointError
from tests.locations import SHARED

MODEL = SHARED / "models/nanodet_plus_m_416/nanodet-plus-m_416.param"
IMAGES = SHARED / "rgbd/redkitchen_a/color"
needs_model = pytest.mark.skipif(not MODEL.exists(), reason="needs the shared NanoDet-Plus files")


@needs_model
def test_it_finds_the_mug_the_table_and_the_chairs_of_a_real_image():
    pytest.importorskip("ncnn")
    detector = NanoDetSegmenter(MODEL)
    color = np.asarray(Image.open(IMAGES / "000315.jpg"))
    found = detector.detect(color, ("cup", "mug", "table", "chair", "wall"), "mug")
    assert found.labels == ("cup", "mug", "table", "chair")
    assert found.ooi == "mug"
    best = {
        label: max(o.score for o in found.instances if o.label == label) for label in found.labels
    }
    assert best["cup"] == best["mug"] > 0.5
    assert best["chair"] > 0.4
    again = detector.detect(color, ("hat",), "hat")
    assert (again.labels, again.ooi, again.instances) == ((), None, ())


def test_of_boxes_that_cover_each_other_the_best_is_kept():
    boxes = np.array([[0, 0, 10, 10], [1, 1, 11, 11], [40, 40, 50, 50], [0, 0, 10, 10]], np.float32)
    assert distinct(boxes, np.array([0.5, 0.9, 0.3, 0.01], np.float32)) == [1, 2]


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("model.pt", b"PK\x03\x04", "is no ncnn .param file"),
        ("model.param", None, "is missing"),
        ("model.param", b"hello", "does not begin with 7767517"),
        ("model.param", b"7767517\n1 1\nInput in 0 1 x\n", "no blobs named data and output"),
        ("model.param", b"7767517\n1 1\nInput data 0 1 data\nX o 1 1 data output\n", "cut off"),
    ],
)
def test_a_file_that_is_no_such_network_is_refused(tmp_path, name, content, text):
    if content is not None:
        (tmp_path / name).write_bytes(content)
        (tmp_path / name).with_suffix(".bin").write_bytes(b"too short")
    with pytest.raises(CheckpointError, match=text):
        NanoDetSegmenter(tmp_path / name)


@needs_model
def test_weights_of_another_length_do_not_crash_the_process(tmp_path):
    pytest.importorskip("ncnn")
    (tmp_path / "m.param").write_bytes(MODEL.read_bytes())
    (tmp_path / "m.bin").write_bytes(MODEL.with_suffix(".bin").read_bytes()[:200_000])
    with pytest.raises(CheckpointError, match=r"does not belong to m\.param"):
        NanoDetSegmenter(tmp_path / "m.param")
