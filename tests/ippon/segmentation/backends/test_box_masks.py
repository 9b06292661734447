"""Networks for masks behind detectors, on tiny random models, against the library's results."""

import importlib.util
import json
from dataclasses import replace

import numpy as np
import pytest

from ippon.observation import Detections, Instance
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import (
    CheckpointError,
    MissingPackageError,
    SegmentationError,
)
from ippon.segmentation.loading import load_segmenter
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
box_masks = later.module("ippon.segmentation.backends.box_masks")
BoxMasks, OutlinedSegmenter = later.names(
    "ippon.segmentation.backends.box_masks", "BoxMasks", "OutlinedSegmenter"
)
tiny_models = later.module("tests.ippon.segmentation.backends.tiny_models")

CONFIG = SegmentationConfig(device="cpu", longest_side_px=32)
BOXES = np.array([[3.0, 4.0, 40.0, 30.0], [10.0, 10.0, 60.0, 47.0], [0.0, 0.0, 64.0, 48.0]])
WITHOUT_TIMM = importlib.util.find_spec("timm") is None
EDGETAM = pytest.param(
    "edgetam", marks=pytest.mark.skipif(WITHOUT_TIMM, reason="EdgeTAM needs timm and torchvision")
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("models")
    tiny_models.save_sam(root / "sam")
    tiny_models.save_sam2(root / "sam2")
    tiny_models.save_grounding_dino(root / "dino")
    if not WITHOUT_TIMM:
        tiny_models.save_edgetam(root / "edgetam")
    return root


@pytest.fixture(params=["sam2", EDGETAM])
def masks(request, folder):
    return BoxMasks(request.param, CONFIG, folder)


@pytest.mark.slow
def test_masks_are_those_of_the_librarys_processor(masks, image_by_formula):
    color = image_by_formula(48, 64)
    normalise = [torch.tensor(v).view(3, 1, 1) for v in masks._normalisation]
    square = torch.nn.functional.interpolate(
        torch.from_numpy(color).permute(2, 0, 1)[None].float(),
        size=(64, 64),
        mode="bilinear",
        antialias=True,
    )
    with torch.inference_mode():
        ours = masks.outline(color, BOXES, (24, 32))
        outputs = masks._model(
            pixel_values=(square / 255.0 - normalise[0]) / normalise[1],
            input_boxes=torch.tensor(BOXES * [1, 64 / 48, 1, 64 / 48])[None].float(),
            multimask_output=False,
        )
    (theirs,) = image_processor("sam2.Sam2ImageProcessor").post_process_masks(
        None, [outputs.pred_masks[0]], [(24, 32)]
    )
    assert ours.shape == (3, 24, 32)
    assert (ours != theirs[:, 0]).float().mean() < 1e-3
    assert 0.02 < ours.float().mean() < 0.98


@WITH_TORCHVISION
def test_images_are_prepared_as_the_librarys_processor_does(masks, image_by_formula, monkeypatch):
    color = image_by_formula(48, 64)
    size = {"height": 64, "width": 64}
    theirs = image_processor("sam2.Sam2ImageProcessor")(size=size)(color, return_tensors="pt")
    given = {}
    real = masks._model.forward
    monkeypatch.setattr(masks._model, "forward", lambda **said: given.update(said) or real(**said))
    with torch.inference_mode():
        masks.outline(color, BOXES, (24, 32))
    # The library rounds to whole grey values; one is 1/255/0.224.
    torch.testing.assert_close(given["pixel_values"], theirs["pixel_values"], atol=0.0176, rtol=0.0)


def test_masks_of_the_first_sam_are_those_of_the_librarys_processor(folder, image_by_formula):
    masks = BoxMasks("sam", CONFIG, folder)
    color = image_by_formula(48, 64)
    low, spread = (torch.tensor(v).view(3, 1, 1) for v in masks._normalisation)
    image = (torch.from_numpy(color).permute(2, 0, 1)[None] / 255.0 - low) / spread
    with torch.inference_mode():
        ours = masks.outline(color, BOXES, (48, 64))
        outputs = masks._model(
            pixel_values=torch.nn.functional.pad(image, (0, 0, 0, 16)),
            input_boxes=torch.tensor(BOXES)[None].float(),
            multimask_output=False,
        )
    (theirs,) = transformers.SamImageProcessorPil().post_process_masks(
        [outputs.pred_masks[0]],
        original_sizes=[(48, 64)],
        reshaped_input_sizes=[(48, 64)],
        pad_size={"height": 64, "width": 64},
    )
    assert (ours != theirs[:, 0]).float().mean() < 1e-3
    assert 0.02 < ours.float().mean() < 0.98


class Boxes:
    """Finds the same instances in every image."""

    def __init__(self, count, mask=None):
        self.instances = tuple(
            Instance(label="cup", score=1.0 - k / 1000, box_px=(k % 8, 2.0, 40.0, 30.0), mask=mask)
            for k in range(count)
        )

    def segment(self, color, labels, ooi):
        return Detections(
            source="fixed",
            labels=tuple(labels),
            ooi=ooi,
            image_size=color.shape[:2],
            instances=self.instances,
            dropped=3,
        )


def test_instances_get_masks_and_keep_the_rest(folder, image_by_formula):
    outlined = OutlinedSegmenter(Boxes(3), BoxMasks("sam2", CONFIG, folder), 32)
    seen = outlined.segment(image_by_formula(48, 64), ("cup", "tv"), "tv")
    assert (seen.source, seen.labels, seen.ooi, seen.dropped) == ("fixed", ("cup", "tv"), "tv", 3)
    for one, bare in zip(seen.instances, Boxes(3).instances, strict=True):
        assert (one.label, one.score, one.box_px) == (bare.label, bare.score, bare.box_px)
        assert one.mask is None or (one.mask.shape == (24, 32) and one.mask.any())
    assert any(one.mask is not None for one in seen.instances)


@pytest.mark.parametrize("precision", ["float16", "bfloat16"])
def test_half_precision_outlines_about_the_same(folder, image_by_formula, precision):
    color = image_by_formula(48, 64)
    half = replace(CONFIG, precision=precision)
    networks = [BoxMasks("sam2", which, folder) for which in (CONFIG, half)]
    for network in networks:
        # Of four masks SAM 2 returns the most stable, and rounding may make that another one.
        network._model.mask_decoder.dynamic_multimask_via_stability = False
    with torch.inference_mode():
        one, other = (network.outline(color, BOXES, (24, 32)) for network in networks)
    assert (one != other).float().mean() < 0.05


def test_masks_that_are_there_stay_and_no_box_is_no_work(folder, image_by_formula, monkeypatch):
    masks = BoxMasks("sam2", CONFIG, folder)
    monkeypatch.setattr(masks, "outline", None)
    mask = np.ones((4, 4), np.bool_)
    for boxes in (Boxes(0), Boxes(2, mask)):
        seen = OutlinedSegmenter(boxes, masks, 32).segment(image_by_formula(8, 8), ("cup",), None)
        assert seen.instances == boxes.instances


def test_masks_that_are_not_numbers_are_an_error_and_no_boxes(folder, image_by_formula):
    one = BoxMasks("sam2", CONFIG, folder)
    parameter = next(one._model.mask_decoder.parameters())
    parameter.data.fill_(float("nan"))
    with pytest.raises(SegmentationError, match="masks that are not numbers"):
        one.outline(image_by_formula(48, 64), BOXES, (24, 32))


def test_only_the_best_instances_get_masks(folder, image_by_formula, monkeypatch):
    masks = BoxMasks("sam2", CONFIG, folder)
    asked = []
    monkeypatch.setattr(
        masks,
        "outline",
        lambda _, boxes, size: asked.append(len(boxes)) or torch.ones(len(boxes), *size) > 0,
    )
    outlined = OutlinedSegmenter(Boxes(box_masks.MOST_MASKS + 5), masks, 32)
    seen = outlined.segment(image_by_formula(48, 64), ("cup",), None)
    assert asked == [box_masks.MOST_MASKS]
    assert [one.mask is None for one in seen.instances] == [False] * box_masks.MOST_MASKS + [
        True
    ] * 5


@pytest.mark.slow
def test_grounding_dino_has_a_network_for_masks(folder, image_by_formula):
    def loaded(masks_model):
        config = SegmentationConfig(
            backend="grounding-dino",
            model="dino",
            masks_model=masks_model,
            device="cpu",
            longest_side_px=32,
        )
        return load_segmenter(config, folder)

    color, labels = image_by_formula(48, 64), ("wall", "cup", "lamp", "tv")
    bare = loaded("none").segment(color, labels, None)
    seen = loaded("sam2").segment(color, labels, None)
    assert [one.box_px for one in seen.instances] == [one.box_px for one in bare.instances]
    assert bare.instances
    assert all(one.mask is None for one in bare.instances)
    assert any(one.mask is not None for one in seen.instances)
    with pytest.raises(
        CheckpointError,
        match=r"sam2.1-hiera-tiny \(160 MB, Apache 2.0\) are not",
    ):
        loaded("")


def test_a_network_that_outlines_no_boxes_is_refused(folder, tmp_path):
    with pytest.raises(CheckpointError) as caught:
        BoxMasks("dino", CONFIG, folder)
    assert str(caught.value) == (
        f"{folder / 'dino'} is another model: its config.json says 'mm-grounding-dino'; expected "
        "'sam' or 'sam2' or 'sam2_video' or 'edgetam' or 'edgetam_video'"
    )
    with pytest.raises(CheckpointError, match=r"the weights of .*/nowhere are not on this machine"):
        BoxMasks(str(tmp_path / "nowhere"), CONFIG, folder)
    (tmp_path / "config.json").write_text("{}")
    with pytest.raises(
        CheckpointError, match=r"is another model: its config.json says ''; expected"
    ):
        BoxMasks(str(tmp_path), CONFIG, folder)


@pytest.mark.skipif(not WITHOUT_TIMM, reason="timm is installed")
def test_edgetam_says_which_packages_it_needs(tmp_path):
    config = transformers.EdgeTamConfig().to_dict()
    (tmp_path / "config.json").write_text(json.dumps(config))
    with pytest.raises(MissingPackageError) as caught:
        BoxMasks(str(tmp_path), CONFIG, tmp_path)
    assert "pip install timm torchvision" in str(caught.value)
