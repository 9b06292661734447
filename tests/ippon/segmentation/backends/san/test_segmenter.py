"""SAN as a segmenter: labels that change, sizes, files that are missing or wrong."""

import dataclasses

import numpy as np
import pytest

from ippon.segmentation.backends.san.tokenizer import ClipTokenizer
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import (
    CheckpointError,
    OutOfMemoryError,
    SegmentationError,
)
from ippon.segmentation.loading import load_segmenter
from tests import later
from tests.ippon.segmentation.backends.san.test_network import TINY

# torch and transformers take seconds to load.
pytestmark = pytest.mark.slow

later.needs("torch", extra="segmentation")
torch = later.module("torch")
save_file = later.names("safetensors.torch", "save_file")
load_network, network_of = later.names(
    "ippon.segmentation.backends.san.checkpoint", "load_network", "network_of"
)
SanNetwork = later.names("ippon.segmentation.backends.san.network", "SanNetwork")
SanSegmenter, label_probabilities = later.names(
    "ippon.segmentation.backends.san.segmenter", "SanSegmenter", "label_probabilities"
)

TOKENIZER = ClipTokenizer([])
SMALL = dataclasses.replace(TINY, text_vocabulary=514)
CONFIG = SegmentationConfig(short_side_px=64, longest_side_px=32, device="cpu")
LABELS = ("wall", "chest_of_drawers", "others")


@pytest.fixture(scope="module")
def state(weights_by_formula):
    with torch.device("meta"):
        shapes = {k: tuple(v.shape) for k, v in SanNetwork(SMALL).state_dict().items()}
    del shapes["ov_classifier.attn_mask"]
    return {k: torch.from_numpy(np.asarray(v)) for k, v in weights_by_formula(shapes).items()}


@pytest.fixture
def segmenter(state):
    return SanSegmenter(network_of(state, SMALL, "formula"), TOKENIZER, CONFIG)


@pytest.mark.parametrize("size", [(48, 64), (70, 50), (64, 64), (7, 300), (1, 1)])
def test_images_of_any_size_give_probabilities(segmenter, image_by_formula, size):
    heatmap = segmenter.segment(image_by_formula(*size), LABELS, "hat")
    h, w, channels = heatmap.probabilities.shape
    assert channels == 4
    assert max(h, w) == min(32, max(size))
    assert (heatmap.probabilities.sum(axis=2, dtype=int) == 255).all()


def test_labels_change_without_reloading_and_each_is_embedded_once(segmenter, image_by_formula):
    image = image_by_formula(48, 64)
    first = segmenter.segment(image, LABELS, "hat")
    assert segmenter.embedded == 4
    segmenter.segment(image, LABELS, "mug")
    segmenter.segment(image, (*LABELS, "robot"), "hat")
    assert segmenter.embedded == 6
    again = segmenter.segment(image, LABELS, "hat")
    np.testing.assert_array_equal(first.probabilities, again.probabilities)
    assert segmenter.embedded == 6


def test_the_order_of_labels_is_the_order_of_channels(segmenter, image_by_formula):
    image = image_by_formula(48, 64)
    there = segmenter.segment(image, LABELS, None).probabilities
    back = segmenter.segment(image, LABELS[::-1], None).probabilities
    assert np.abs(there.astype(int) - back[..., ::-1]).max() <= 1


def test_half_precision_gives_similar_results(state, image_by_formula):
    image = image_by_formula(48, 64)
    half = SegmentationConfig(
        short_side_px=64, longest_side_px=32, device="cpu", precision="bfloat16"
    )
    full = SanSegmenter(network_of(state, SMALL, "f"), TOKENIZER, CONFIG)
    clone = {name: tensor.clone() for name, tensor in state.items()}
    low = SanSegmenter(network_of(clone, SMALL, "f"), TOKENIZER, half)
    a = full.segment(image, LABELS, "hat").probabilities.astype(int)
    b = low.segment(image, LABELS, "hat").probabilities.astype(int)
    assert np.abs(a - b).max() <= 16


def test_pixels_outside_all_masks_carry_no_evidence():
    classes, masks = torch.zeros(3, 5), torch.full((3, 4, 4), -50.0)
    p = label_probabilities(classes, masks, (1.0, 1.0), (8, 8))
    torch.testing.assert_close(p, torch.full((4, 8, 8), 0.25))


def test_padding_is_cut_off():
    masks = torch.full((1, 4, 4), -50.0)
    masks[0, :, 3] = 50.0
    classes = torch.tensor([[9.0, 0.0, 0.0]])
    p = label_probabilities(classes, masks, (1.0, 0.75), (4, 3))
    torch.testing.assert_close(p[0, :, :2], torch.full((4, 2), 0.5))


@pytest.mark.parametrize("suffix", [".pth", ".safetensors"])
def test_checkpoints_are_read_as_released(state, tmp_path, suffix):
    path = tmp_path / f"san{suffix}"
    training = {"criterion.empty_weight": torch.ones(3)}
    if suffix == ".pth":
        torch.save({"model": {**state, **training}, "iteration": 60000}, path)
    else:
        save_file({**state, **training}, path)
    network = load_network(path, SMALL)
    torch.testing.assert_close(network.ov_classifier.bg_embed, state["ov_classifier.bg_embed"])
    assert not any(p.requires_grad for p in network.parameters())


def test_a_missing_checkpoint_names_file_source_folder_and_alternatives(tmp_path):
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(SegmentationConfig(model="san_vit_large_14"), tmp_path)
    text = str(caught.value)
    for said in (
        "san_vit_large_14.pth",
        "https://huggingface.co/Mendel192/san",
        "https://github.com/MendelXu/SAN",
        str(tmp_path),
        "Without it `ippon demo`",
    ):
        assert said in text


def test_a_missing_list_of_merges_says_so(state, tmp_path):
    torch.save({"model": state}, tmp_path / "san_vit_b_16.pth")
    with pytest.raises(CheckpointError, match=r"put bpe_simple_vocab_16e6.txt.gz \(from https"):
        load_segmenter(SegmentationConfig(), tmp_path)


def test_weights_that_do_not_fit_are_named(state, tmp_path):
    path = tmp_path / "san.pth"
    torch.save({"model": {"conv1.weight": torch.zeros(3)}}, path)
    with pytest.raises(CheckpointError, match=r"is not a released SAN .*san_vit_b_16 and"):
        load_network(path)
    damaged = dict(state)
    del damaged["clip_rec_head.proj"]
    damaged["extra"] = torch.zeros(1)
    damaged["ov_classifier.bg_embed"] = torch.zeros(1, 13)
    torch.save({"model": damaged}, path)
    with pytest.raises(CheckpointError) as caught:
        load_network(path, SMALL)
    assert "1 missing (clip_rec_head.proj); 1 unknown (extra); 1 of another shape" in str(
        caught.value
    )
    assert "ov_classifier.bg_embed is (1, 13), not (1, 12)" in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"no checkpoint at all", b"PK\x03\x04 damaged"])
def test_files_that_are_not_checkpoints_are_rejected(tmp_path, content):
    path = tmp_path / "san.pth"
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match=r"san.pth is not a checkpoint of weights \("):
        load_network(path)


def test_a_checkpoint_never_runs_code(tmp_path):
    path = tmp_path / "san.pth"
    torch.save({"model": pytest.approx}, path)
    with pytest.raises(CheckpointError, match="is not a checkpoint of weights"):
        load_network(path)
    torch.save([1, 2], path)
    with pytest.raises(CheckpointError, match="holds no weights by name"):
        load_network(path)


def test_a_model_of_no_known_name_is_refused(tmp_path):
    with pytest.raises(CheckpointError, match="no checkpoint at nosuch; give a file, or one of"):
        load_segmenter(SegmentationConfig(model="nosuch"), tmp_path)


def test_out_of_memory_says_what_would_fit(segmenter, image_by_formula, monkeypatch):
    def full(*arguments):
        raise torch.OutOfMemoryError("CUDA out of memory")

    monkeypatch.setattr(segmenter, "_run", full)
    with pytest.raises(OutOfMemoryError, match="memory ran out in SAN on an image of 64x48; a"):
        segmenter.segment(image_by_formula(48, 64), LABELS, None)


def test_a_missing_device_is_named(state, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    for name, said in (("cuda", "sees no GPU"), ("tpu9", "cpu, cuda or cuda:N; got 'tpu9'")):
        with pytest.raises(SegmentationError, match=said):
            SanSegmenter(network_of(state, SMALL, "f"), TOKENIZER, SegmentationConfig(device=name))
