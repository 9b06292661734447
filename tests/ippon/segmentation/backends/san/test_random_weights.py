"""Networks that have learnt nothing, and what `ippon doctor --segmentation` says of them."""

import pytest

from app.doctor.segmentation_speed import FEWEST, measure, measure_network
from ippon.observation import Heatmap
from ippon.segmentation.backends.san.architecture import SanArchitecture
from ippon.segmentation.backends.san.tokenizer import ClipTokenizer
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import CheckpointError
from tests import later

# torch and transformers take seconds to load.
pytestmark = pytest.mark.slow

later.needs("torch", extra="segmentation")
torch = later.module("torch")
random_network = later.names("ippon.segmentation.backends.san.random_weights", "random_network")
SanSegmenter = later.names("ippon.segmentation.backends.san.segmenter", "SanSegmenter")

SMALL = SanArchitecture(
    clip_layers=3,
    clip_width=16,
    clip_heads=2,
    clip_patch_px=16,
    clip_image_px=64,
    clip_scale=0.5,
    recognition_from=2,
    embedding_width=12,
    text_layers=1,
    text_width=12,
    text_heads=2,
    text_vocabulary=514,
    side_layers=2,
    side_width=12,
    side_heads=2,
    fusion=(0, 1),
    queries=5,
    mask_width=8,
)


def test_the_same_seed_draws_the_same_network(image_by_formula):
    config = SegmentationConfig(device="cpu", short_side_px=64)
    first, second = (
        SanSegmenter(random_network(SMALL, seed), ClipTokenizer([]), config) for seed in (4, 4)
    )
    a, b = (s.segment(image_by_formula(48, 64), ("wall", "floor"), "hat") for s in (first, second))
    assert (a.probabilities == b.probabilities).all()


def test_speed_is_the_median_without_the_first_image():
    class Network:
        calls = 0

        def segment(self, color, labels, ooi):
            self.calls += 1
            assert color.shape == (640, 640, 3)
            p = torch.zeros(1, 1, 41, dtype=torch.uint8).numpy()
            return Heatmap(labels=tuple(labels), ooi=ooi, probabilities=p)

    network = Network()
    speed = measure(network, "a test")
    assert network.calls > FEWEST
    assert "images/s" in str(speed)
    assert str(speed).endswith("a test")


def test_only_san_is_measured_without_its_weights(tmp_path):
    config = SegmentationConfig(backend="clipseg", model="some/clipseg")
    with pytest.raises(CheckpointError, match=r"https://huggingface.co/some/clipseg"):
        measure_network(config, tmp_path)
    with pytest.raises(CheckpointError, match="no checkpoint at nosuch"):
        measure_network(SegmentationConfig(model="nosuch"), tmp_path)
