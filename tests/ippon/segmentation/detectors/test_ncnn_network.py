"""NanoDet-Plus on real images of a room, and files that are no network."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ncnn = pytest.importorskip("ncnn", reason="the extra ippon[detector] is not installed")

from ippon.segmentation.config import SegmentationConfig  # noqa: E402
from ippon.segmentation.detectors.detector import LEAST_SCORE  # noqa: E402
from ippon.segmentation.detectors.vocabulary import unsupported_reason  # noqa: E402
from ippon.segmentation.errors import CheckpointError, SegmentationError  # noqa: E402
from ippon.segmentation.loading import load_segmenter  # noqa: E402
from tests.locations import SHARED  # noqa: E402

NANODET = SHARED / "models/nanodet_plus_m_416/nanodet-plus-m_416.param"
ROOM = SHARED / "rgbd/redkitchen_a"
LABELS = ("wall", "chair", "table", "tv", "book", "sofa")

here = pytest.mark.skipif(not NANODET.exists(), reason="needs ../shared/models")
real = pytest.mark.skipif(not ROOM.exists() or not NANODET.exists(), reason="needs ../shared")


def load(path, **options):
    options = {"threads": 1, **options}
    config = SegmentationConfig(backend="detector", model=str(path), **options)
    return load_segmenter(config, path.parent)


@pytest.fixture(scope="module")
def nanodet():
    return load(NANODET)


@pytest.fixture(scope="module")
def seen(nanodet):
    """Detections in every tenth image of the room."""
    frames = sorted((ROOM / "color").iterdir())[::10]
    return [nanodet.segment(np.asarray(Image.open(f)), LABELS, "cup") for f in frames]


@pytest.mark.slow
@real
def test_things_of_a_real_room_are_found(seen):
    best = {}
    for image in seen:
        assert image.labels == ("chair", "table", "tv", "book", "sofa", "cup")
        assert (image.ooi, image.source) == ("cup", "nanodet-plus-m_416")
        assert image.image_size == (480, 640)
        # Weak boxes in the border that fills the input up lie outside the image.
        assert image.dropped < 5
        for one in image.instances:
            best[one.label] = max(best.get(one.label, 0.0), one.score)
    assert min(best[label] for label in ("chair", "tv", "cup", "table")) > 0.5
    assert best["book"] > 0.4
    assert best.get("sofa", 0.0) < 0.5


@real
def test_boxes_lie_in_the_image_with_their_best_first(seen):
    for image in seen:
        scores = [one.score for one in image.instances]
        assert scores == sorted(scores, reverse=True)
        assert min(scores) >= LEAST_SCORE
        boxes = np.array([one.box_px for one in image.instances])
        assert (boxes[:, :2] < boxes[:, 2:]).all()
        assert (boxes >= 0).all()
        assert (boxes <= [640, 480, 640, 480]).all()


@pytest.fixture(scope="module")
def cups(nanodet):
    """Detections for a cup in every second image of the room, by the file's name."""
    files = sorted((ROOM / "color").iterdir())[::2]
    found = (nanodet.segment(np.asarray(Image.open(f)), ("wall",), "cup") for f in files)
    return {f.name: one.instances for f, one in zip(files, found, strict=True)}


@pytest.mark.slow
@real
def test_the_white_cup_is_where_it_was_labelled(cups):
    """The cup's known place, projected, lies in the best box for a cup."""
    sequence = json.loads((ROOM / "sequence.json").read_text())
    objects = json.loads((ROOM / "objects.json").read_text())["objects"]
    known = np.array([one["centre_world"] for one in objects if one["label"] == "cup"])
    right = surely = 0
    for frame in sequence["frames"][::4]:
        found = cups[Path(frame["color"]).name]
        pose = np.array(frame["camera_to_world"])
        points = (known - pose[:3, 3]) @ pose[:3, :3]
        k = sequence["intrinsics"]
        u = k["fx"] * points[:, 0] / points[:, 2] + k["cx"]
        v = k["fy"] * points[:, 1] / points[:, 2] + k["cy"]
        for one in found:
            if one.score > 0.5:
                left, top, right_px, bottom = one.box_px
                margin = 15.0
                inside = (points[:, 2] > 0) & (left - margin < u) & (u < right_px + margin)
                inside &= (top - margin < v) & (v < bottom + margin)
                surely += 1
                right += bool(inside.any())
    assert surely >= 15
    assert right >= 0.9 * surely


@real
@pytest.mark.slow
def test_scores_are_those_that_others_measured(cups):
    """Cups that touch no border, by score; another program found twice as many in all images."""
    edges = (0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 1.0)
    measured = 0.5 * np.array([389, 111, 46, 60, 26, 93])
    scores = []
    for found in cups.values():
        for one in found:
            left, top, right, bottom = one.box_px
            if left > 1 and top > 1 and right < 639 and bottom < 479:
                scores.append(one.score)
    counted, _ = np.histogram(scores, edges)
    assert abs(counted[-1] - measured[-1]) <= 5
    assert (np.abs(counted - measured) <= 0.3 * measured).all(), counted


@here
def test_an_unknown_object_is_refused_in_words(nanodet):
    assert nanodet.segment(np.zeros((48, 64, 3), np.uint8), ("wall",), "hat").labels == ()
    assert "knows 80 kinds of thing and 'hat' is none of them" in unsupported_reason(nanodet, "hat")
    assert unsupported_reason(nanodet, "sofa") is None


@here
@pytest.mark.parametrize("shape", [(480, 640), (640, 480), (7, 900), (1, 1), (2000, 1500)])
def test_images_of_any_shape_are_taken(nanodet, shape):
    color = np.random.default_rng(0).integers(0, 256, (*shape, 3), dtype=np.uint8)
    assert nanodet.segment(color, LABELS, "cup").image_size == shape


@pytest.mark.slow
@here
def test_a_detector_gets_no_second_pass():
    detector = load(NANODET, small_objects=True)
    assert type(detector).__name__ == "Detector"
    assert load(NANODET.with_suffix(".bin")).source == "nanodet-plus-m_416"


@here
def test_another_size_of_input_is_taken(nanodet):
    small = load(NANODET, input_px=320)
    assert small.image_input.size == (320, 320)
    assert nanodet.image_input.size == (416, 416)


@pytest.fixture
def copied(tmp_path):
    """A copy of both files, to be damaged."""
    for suffix in (".param", ".bin"):
        shutil.copy(NANODET.with_suffix(suffix), tmp_path / f"net{suffix}")
    return tmp_path / "net.param"


def refused(path, text, **options):
    with pytest.raises(CheckpointError) as caught:
        load(path, **options)
    assert text in str(caught.value)


@here
def test_weights_must_lie_beside(copied):
    copied.with_suffix(".bin").unlink()
    refused(copied, "net.param needs its weights beside it: there is no net.bin in")


@here
@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda b: b[:-7], "does not belong to its .param file, or is cut off: at byte"),
        (lambda b: b[: len(b) // 2], "it lacks the "),
        (lambda _: b"", "at byte 0 of 0 it lacks the 648 weights of layer Conv_0"),
        (lambda b: b + b"\0" * 8, "the network has 2397184 bytes of weights and the file 2397192"),
        (lambda b: b"\xff" * len(b), "it lacks the 648 weights of layer Conv_0"),
    ],
)
def test_weights_of_another_network_are_refused(copied, change, text):
    weights = copied.with_suffix(".bin")
    weights.write_bytes(change(weights.read_bytes()))
    refused(copied, text)


@here
@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda t: t[: t.index("Split ")], "is damaged or cut off: it says 240 layers and holds "),
        (
            lambda t: t.replace("7767517", "hello world"),
            "it begins with 'hello world', not 7767517",
        ),
        (lambda t: t[:2000], "net.param is damaged: "),
        (lambda t: t[:8] + "\n" * 9, "is damaged or cut off: it says 0 layers and holds 0"),
        (lambda t: t.replace("240 280", "240 281"), "it says 281 blobs and holds 280"),
        (lambda t: t.replace("240 280", "many"), "net.param is damaged: "),
        (
            lambda t: t.replace("1 1 890 891", "1 1 nowhere 891"),
            "layer MaxPool_2 takes nowhere, which none makes before it",
        ),
        (lambda t: t.replace("1 1 890 891", "1 1 890 890"), "layer MaxPool_2 makes 890 again"),
        (lambda t: t.replace("1 1 890 891", "9 9 890 891"), "layer MaxPool_2 is cut off"),
        (lambda t: t.replace("Permute ", "Wormhole "), "ncnn does not load it"),
        (lambda t: t.replace("Input  ", "Noop   "), "takes 0 inputs; a detector takes one"),
        (lambda t: t.replace("0 1 data", "0 1 data 0=416 1=x"), "takes images of 416xx; a"),
        (
            lambda t: t.replace("0 1 data", "0 1 data 0=416 1=999999"),
            "takes images of 416x999999; a detector takes at most 8192 pixels a side",
        ),
        (lambda t: t.replace("5=1 6=648", "5=99999999999 6=648"), "net.param"),
    ],
)
def test_damaged_structures_are_refused(copied, change, text):
    copied.write_text(change(copied.read_text()))
    refused(copied, text)


@here
def test_a_network_at_which_ncnn_dies_is_refused(copied):
    """Slices that end beyond what they cut, filters for more channels than there are."""
    text = copied.read_text()
    copied.write_text(text.replace("1=3 3=2 4=1 5=1 6=648", "1=3 3=2 4=1 5=1 6=648 2=90000"))
    with pytest.raises(CheckpointError, match=r"net\.param with net\.bin"):
        load(copied)


@here
def test_bytes_in_place_of_structure_are_refused(copied):
    copied.write_bytes(bytes(range(256)) * 9)
    refused(copied, "net.param is not an ncnn .param file: it is not text")


@pytest.mark.slow
@here
def test_classes_that_the_output_lacks_are_refused(tmp_path):
    labels = tmp_path / "labels.txt"
    labels.write_text("\n".join(f"thing {k}" for k in range(200)))
    refused(NANODET, "NanoDet-Plus with 200 classes gives (3598, 200 + 4 x bins)",
            labels_file=str(labels))  # fmt: skip
    labels.write_text("\n".join(f"thing {k}" for k in range(79)))
    refused(NANODET, "this network gives (3598, 112)", labels_file=str(labels))


@here
def test_a_gpu_is_refused():
    with pytest.raises(SegmentationError, match="ncnn files run on the processor; got the device"):
        load(NANODET, device="cuda")


@here
def test_another_family_is_refused():
    refused(NANODET, "these outputs are those of nanodet, not of yolox", family="yolox")
