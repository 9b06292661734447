"""A network for masks behind a detector."""

import numpy as np
import pytest

from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.detectors.detector import Detector
from ippon.segmentation.detectors.vocabulary import unsupported_reason
from ippon.segmentation.errors import CheckpointError
from ippon.segmentation.loading import load_segmenter
from ippon.segmentation.model_registry import models_of
from ippon.segmentation.segmenter import segment_tour
from tests import later

# torch and transformers take seconds to load.
pytestmark = pytest.mark.slow

later.needs("torch", "transformers", extra="segmentation")
later.needs("onnxruntime", extra="detector")
later.needs("onnx", extra="dev")
outlined_detector = later.names(
    "ippon.segmentation.backends.open_vocabulary_detectors", "outlined_detector"
)
bright_box_network = later.names("tests.onnx_graphs", "bright_box_network")
tiny_models = later.module("tests.ippon.segmentation.backends.tiny_models")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("models")
    tiny_models.save_sam2(root / "sam2")
    bright_box_network(root / "bright.onnx", 64, 0.5)
    return root


def config(folder, masks_model):
    return SegmentationConfig(
        backend="detector",
        model=str(folder / "bright.onnx"),
        masks_model=masks_model,
        device="cpu",
        longest_side_px=32,
    )


def scene():
    color = np.zeros((48, 64, 3), np.uint8)
    color[10:30, 20:45] = 255
    return color


def test_boxes_of_a_detector_become_masks(folder):
    bare = load_segmenter(config(folder, ""), folder).segment(scene(), ("cup", "tv"), None)
    segmenter = load_segmenter(config(folder, "sam2"), folder)
    seen = segmenter.segment(scene(), ("cup", "tv"), None)
    assert [one.label for one in seen.instances] == ["cup"]
    assert seen.instances[0].box_px == bare.instances[0].box_px
    assert bare.instances[0].mask is None
    assert seen.instances[0].mask.shape == (24, 32)
    assert seen.source == bare.source


@pytest.mark.parametrize("masks_model", ["", "sam2"])
def test_all_objects_of_a_tour_come_before_common_labels(folder, masks_model):
    segmenter = load_segmenter(config(folder, masks_model), folder)
    seen = segment_tour(segmenter, scene(), ("cup", "tv", "mug"), ("keys", "mug"))
    assert [one.label for one in seen.instances] == ["mug"]
    assert seen.labels == ("tv", "mug")
    assert (seen.instances[0].mask is None) == (masks_model == "")


def test_the_detector_still_reports_unknown_objects(folder):
    segmenters = [load_segmenter(config(folder, name), folder) for name in ("none", "sam2")]
    one, other = (unsupported_reason(segmenter, "screwdriver") for segmenter in segmenters)
    assert one
    assert one == other


def test_the_network_for_masks_must_be_there(folder):
    with pytest.raises(CheckpointError, match=r"the weights of facebook/sam2.1-hiera-tiny \("):
        load_segmenter(config(folder, "facebook/sam2.1-hiera-tiny"), folder)
    detector = Detector(config(folder, ""), folder)
    with pytest.raises(ValueError, match="no network for masks is configured; set masks_model"):
        outlined_detector(detector, config(folder, ""), folder)


def test_only_a_network_for_masks_that_is_named_is_fetched(folder):
    assert models_of(config(folder, "")) == ()
    assert models_of(config(folder, "yonigozlan/EdgeTAM-hf")) == ("yonigozlan/EdgeTAM-hf",)
