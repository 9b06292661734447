"""SAM 3 and its light variant, on tiny random models, against the library's own results."""

import json
from pathlib import Path

import numpy as np
import pytest

from ippon.observation import Detections
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import CheckpointError, SegmentationError
from ippon.segmentation.loading import load_segmenter
from ippon.segmentation.model_registry import DEFAULT_MODELS, MODELS
from tests import later
from tests.ippon.segmentation.backends.library_processors import (
    WITH_TORCHVISION,
    image_processor,
)

# torch and transformers take seconds to load.
pytestmark = pytest.mark.slow

later.needs("torch", "transformers", extra="segmentation")
torch = later.module("torch")
transformers = later.module("transformers")
sam3 = later.module("ippon.segmentation.backends.sam3")
Sam3Segmenter = later.names("ippon.segmentation.backends.sam3", "Sam3Segmenter")
tiny_models = later.module("tests.ippon.segmentation.backends.tiny_models")

LABELS = ("wall", "chest_of_drawers", "others", "tv", "lamp")
WORDS = ("wall", "chest of drawers", "other thing", "television", "lamp")
BACKENDS = ("sam3", "sam3-lite")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("models")
    tiny_models.save_sam3(root / "sam3-tiny")
    tiny_models.save_sam3_lite(root / "sam3-lite-tiny")
    return root


def config(backend, **fields):
    fields = {"model": f"some-hub/{backend}-tiny", "device": "cpu", "longest_side_px": 32} | fields
    return SegmentationConfig(backend=backend, **fields)


@pytest.fixture(params=BACKENDS)
def segmenter(request, folder):
    return Sam3Segmenter(config(request.param), folder)


def given_by_library(segmenter, color, words):
    """Run the model as the library's documentation does: one text, the whole image."""
    tokens = segmenter._tokenizer([words], padding="max_length", max_length=32, return_tensors="pt")
    with torch.inference_mode():
        return segmenter._model(
            pixel_values=segmenter._prepare(color),
            input_ids=tokens["input_ids"],
            attention_mask=tokens["attention_mask"],
        )


def test_instances_are_those_of_the_librarys_processor(segmenter, image_by_formula):
    """Encoding the image once and several labels at once changes nothing."""
    color = image_by_formula(48, 64)
    with torch.inference_mode():
        ours = segmenter._find(color, LABELS, (24, 32))
    processor = image_processor("sam3.Sam3ImageProcessor")
    for number, words in enumerate(WORDS):
        outputs = given_by_library(segmenter, color, words)
        (theirs,) = processor.post_process_instance_segmentation(
            None, outputs, threshold=sam3.LEAST_SCORE, target_sizes=[(24, 32)]
        )
        mine = torch.nonzero(ours.channels == number)[:, 0]
        assert len(mine) == len(theirs["scores"]) > 0
        best = theirs["scores"].argsort(descending=True)
        torch.testing.assert_close(ours.scores[mine], theirs["scores"][best], atol=1e-5, rtol=1e-4)
        extent = torch.tensor([32, 24, 32, 24])
        torch.testing.assert_close(
            ours.boxes[mine] * extent, theirs["boxes"][best], atol=1e-3, rtol=1e-4
        )
        # Sums of other orders may tip single pixels of the edge.
        assert (ours.masks[mine] != theirs["masks"][best].bool()).float().mean() < 1e-3
    assert ours.scores.std() > 1e-3
    assert 0.05 < ours.masks.float().mean() < 0.95


@WITH_TORCHVISION
def test_images_are_prepared_as_the_librarys_processor_does(segmenter, image_by_formula):
    color = image_by_formula(48, 64)
    side = segmenter._model.config.vision_config.image_size
    processor = image_processor("sam3.Sam3ImageProcessor")(size={"height": side, "width": side})
    theirs = processor(color, return_tensors="pt")["pixel_values"]
    # The library rounds to whole grey values; a step is 2/255 here.
    torch.testing.assert_close(segmenter._prepare(color), theirs, atol=2.01 / 255, rtol=0.0)


def test_detections_lie_in_the_image_and_carry_the_labels(segmenter, image_by_formula):
    for size in ((48, 64), (70, 50), (9, 200)):
        seen = segmenter.segment(image_by_formula(*size), LABELS, "hat")
        assert isinstance(seen, Detections)
        assert (seen.labels, seen.ooi, seen.image_size) == ((*LABELS, "hat"), "hat", size)
        assert seen.instances
        for one in seen.instances:
            left, top, right, bottom = one.box_px
            assert 0 <= left < right <= size[1]
            assert 0 <= top < bottom <= size[0]
            assert 0 < one.score <= 1
            assert one.mask is None or max(one.mask.shape) == 32
    assert seen.source in BACKENDS
    assert segmenter.segment(image_by_formula(48, 64), ("wall",), None).labels == ("wall",)


@pytest.mark.parametrize("precision", ["float16", "bfloat16"])
@pytest.mark.parametrize("backend", BACKENDS)
def test_half_precision_finds_about_the_same(folder, image_by_formula, backend, precision):
    color = image_by_formula(48, 64)
    full = Sam3Segmenter(config(backend), folder).segment(color, LABELS, None)
    half = Sam3Segmenter(config(backend, precision=precision), folder).segment(color, LABELS, None)
    assert half.instances[0].score == pytest.approx(full.instances[0].score, abs=0.03)
    assert abs(len(half.instances) - len(full.instances)) <= 0.3 * len(full.instances)


def test_an_image_that_cannot_be_written_to_is_taken(segmenter, image_by_formula):
    color = image_by_formula(48, 64)
    color.flags.writeable = False
    assert segmenter.segment(color, LABELS, None).instances


def test_the_order_of_labels_does_not_matter(segmenter, image_by_formula):
    color = image_by_formula(48, 64)
    one, other = (segmenter.segment(color, labels, None) for labels in (LABELS, LABELS[::-1]))
    assert [(i.label, i.box_px) for i in one.instances] == [
        (i.label, i.box_px) for i in other.instances
    ]


def test_a_thing_that_two_labels_fit_is_one_instance(segmenter, image_by_formula):
    """Two labels of the same words find the same boxes with the same scores."""
    alone = segmenter.segment(image_by_formula(48, 64), ("television",), None)
    both = segmenter.segment(image_by_formula(48, 64), ("tv", "television"), None)
    boxes = [[one.box_px for one in found.instances] for found in (both, alone)]
    assert len(boxes[0]) == len(boxes[1])
    np.testing.assert_allclose(*boxes, atol=1e-3)


def test_the_image_is_encoded_once_and_words_once_for_all_images(
    segmenter, image_by_formula, monkeypatch
):
    counts = {"image": 0, "words": 0}

    def counted(name, real):
        def call(*args, **kwargs):
            counts[name] += 1
            return real(*args, **kwargs)

        return call

    model = segmenter._model
    monkeypatch.setattr(model, "get_vision_features", counted("image", model.get_vision_features))
    monkeypatch.setattr(model, "get_text_features", counted("words", model.get_text_features))
    for _ in range(3):
        segmenter.segment(image_by_formula(48, 64), LABELS, "hat")
    assert counts == {"image": 3, "words": 1}
    segmenter.segment(image_by_formula(48, 64), LABELS, "cap")
    assert counts == {"image": 4, "words": 2}


def test_nan_is_rejected(segmenter, image_by_formula):
    with torch.no_grad():
        segmenter._model.dot_product_scoring.query_proj.bias.fill_(float("nan"))
    with pytest.raises(SegmentationError, match="values that are not numbers; try --segmentation"):
        segmenter.segment(image_by_formula(48, 64), LABELS, None)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_missing_model_names_its_source(tmp_path, backend):
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(config(backend, model=""), tmp_path)
    name = DEFAULT_MODELS[backend]
    assert f"https://huggingface.co/{name}" in str(caught.value)
    assert f"the weights of {name} ({MODELS[name].megabytes} MB, SAM License" in str(caught.value)


def test_another_architecture_is_refused(folder):
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(config("sam3", model=str(folder / "sam3-lite-tiny")), folder)
    assert "sam3-lite-tiny is another model: its config.json says 'sam3_lite_text'; expected " in (
        str(caught.value)
    )
    assert str(caught.value).endswith("expected 'sam3' or 'sam3_video'")


def copied(folder, target, without):
    target.mkdir()
    for path in folder.iterdir():
        if path.name != without:
            (target / path.name).write_bytes(path.read_bytes())
    return target


class Opened:
    """What unpickling it would do."""

    def __init__(self, marker):
        self.marker = marker

    def __reduce__(self):
        return Path.touch, (self.marker,)


def test_pickled_weights_are_refused_and_not_opened(folder, tmp_path):
    where = copied(folder / "sam3-tiny", tmp_path / "pickled", "model.safetensors")
    torch.save({"weights": Opened(tmp_path / "opened")}, where / "pytorch_model.bin")
    with pytest.raises(
        CheckpointError, match=r"pickled is not a folder of such a model: .*safetensors"
    ):
        load_segmenter(config("sam3", model=str(where)), folder)
    assert not (tmp_path / "opened").exists()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "config.json is damaged: Expecting property name"),
        ("[]", "config.json is damaged: expected a JSON object"),
        (json.dumps({"model_type": 3}), "is another model: its config.json says '3'"),
    ],
)
def test_a_damaged_description_is_refused(folder, tmp_path, content, said):
    where = copied(folder / "sam3-tiny", tmp_path / "broken", "config.json")
    (where / "config.json").write_text(content)
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(config("sam3", model=str(where)), folder)
    assert said in str(caught.value)


def test_damaged_weights_are_refused(folder, tmp_path):
    where = copied(folder / "sam3-tiny", tmp_path / "cut", "model.safetensors")
    whole = (folder / "sam3-tiny" / "model.safetensors").read_bytes()
    (where / "model.safetensors").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(CheckpointError, match="cut is not a folder of such a model"):
        load_segmenter(config("sam3", model=str(where)), folder)


def test_bad_input_is_refused(segmenter):
    with pytest.raises(ValueError, match=r"an image is \(H, W, 3\) uint8 RGB; got \(4, 4\)"):
        segmenter.segment(np.zeros((4, 4), np.uint8), LABELS, None)
    with pytest.raises(ValueError, match="labels are distinct; tv came twice"):
        segmenter.segment(np.zeros((4, 4, 3), np.uint8), ("tv", "tv"), None)
