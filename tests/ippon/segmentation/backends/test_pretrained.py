"""The `transformers` backends, on tiny random models saved to a folder and loaded from it."""

import json
import shutil

import pytest

from ippon.observation_model import LEAST_SCORE as LEAST_VALUE
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import CheckpointError, MissingPackageError
from ippon.segmentation.loading import load_segmenter
from tests import later

# torch and transformers take seconds to load.
pytestmark = pytest.mark.slow

later.needs("torch", "transformers", extra="segmentation")
torch = later.module("torch")
transformers = later.module("transformers")
ClipSegSegmenter = later.names("ippon.segmentation.backends.clipseg", "ClipSegSegmenter")
owlv2 = later.module("ippon.segmentation.backends.owlv2")
Owlv2Segmenter = later.names("ippon.segmentation.backends.owlv2", "Owlv2Segmenter")
tiny_models = later.module("tests.ippon.segmentation.backends.tiny_models")

LABELS = ("wall", "chest_of_drawers", "others")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("models")
    tiny_models.save_clipseg(root / "clipseg-tiny")
    tiny_models.save_owlv2(root / "owlv2-tiny")
    tiny_models.save_sam(root / "sam-tiny")
    return root


def config(backend, **fields):
    names = {"clipseg": "some-hub/clipseg-tiny", "owlv2": "some-hub/owlv2-tiny"}
    return SegmentationConfig(
        backend=backend,
        model=names[backend],
        masks_model="some-hub/sam-tiny",
        longest_side_px=32,
        device="cpu",
        **fields,
    )


def test_clipseg_scores_each_label_at_each_pixel_of_images_of_any_size(folder, image_by_formula):
    segmenter = load_segmenter(config("clipseg"), folder)
    for size in ((48, 64), (70, 50), (9, 200)):
        heatmap = segmenter.segment(image_by_formula(*size), LABELS, "hat")
        assert heatmap.ooi_channel == 3
        assert max(heatmap.probabilities.shape[:2]) == 32
        assert (heatmap.kind, heatmap.source) == ("scores", "clipseg")
        assert heatmap.probabilities.min() >= LEAST_VALUE
    other = segmenter.segment(image_by_formula(48, 64), ("wall", "tv"), None)
    assert other.probabilities.shape[2] == 2


def test_clipseg_agrees_with_the_library(folder, image_by_formula):
    """Encoding the image once for all labels changes nothing."""
    segmenter = ClipSegSegmenter(config("clipseg"), folder)
    image = segmenter._prepare(image_by_formula(32, 32))
    with torch.inference_mode():
        ours = segmenter._logits(image, segmenter._conditions(LABELS))
        tokens = segmenter._tokenizer(["a photo of a chest of drawers."], return_tensors="pt")
        theirs = segmenter._model(**tokens, pixel_values=image).logits
    assert ours.std() > 1e-3
    torch.testing.assert_close(ours[1], theirs.reshape(ours.shape[1:]), atol=1e-4, rtol=1e-4)


def test_clipseg_stretches_images_to_the_size_of_its_training(folder, tmp_path, image_by_formula):
    color = image_by_formula(48, 64)
    assert ClipSegSegmenter(config("clipseg"), folder)._prepare(color).shape == (1, 3, 352, 352)
    stated = tmp_path / "clipseg-tiny"
    shutil.copytree(folder / "clipseg-tiny", stated)
    for size, expected in (({"height": 64, "width": 80}, (64, 80)), (96, (96, 96))):
        (stated / "preprocessor_config.json").write_text(json.dumps({"size": size}))
        prepared = ClipSegSegmenter(config("clipseg"), tmp_path)._prepare(color)
        assert prepared.shape == (1, 3, *expected)


def test_owlv2_agrees_with_the_library(folder, image_by_formula):
    segmenter = Owlv2Segmenter(config("owlv2"), folder)
    image = torch.from_numpy(image_by_formula(32, 32)).permute(2, 0, 1)[None].float()
    mean, std = (torch.tensor(v).view(3, 1, 1) for v in segmenter._normalisation)
    with torch.inference_mode():
        boxes, scores = segmenter.find(image, LABELS)
        texts = [
            "a photo of a wall.",
            "a photo of a chest of drawers.",
            "a photo of a other thing.",
        ]
        tokens = segmenter._tokenizer(texts, return_tensors="pt", padding=True)
        outputs = segmenter._finder(
            input_ids=tokens["input_ids"],
            attention_mask=tokens["attention_mask"],
            pixel_values=(image / 255.0 - mean) / std,
        )
    (theirs,) = transformers.Owlv2ImageProcessorPil().post_process_object_detection(
        outputs, threshold=-1.0, target_sizes=[(32, 32)]
    )
    torch.testing.assert_close(boxes, theirs["boxes"], atol=1e-3, rtol=1e-3)
    best, numbers = scores.max(dim=1)
    torch.testing.assert_close(best, theirs["scores"], atol=1e-4, rtol=1e-3)
    assert (numbers == theirs["labels"]).float().mean() > 0.9


def test_owlv2_finds_instances_that_sam_outlines(folder, image_by_formula):
    for size in ((48, 64), (70, 50)):
        seen = load_segmenter(config("owlv2"), folder).segment(
            image_by_formula(*size), LABELS, "hat"
        )
        assert (seen.source, seen.labels, seen.ooi) == ("owlv2", (*LABELS, "hat"), "hat")
        assert seen.image_size == size
        assert seen.instances
        assert all(owlv2.LEAST_SCORE < one.score <= 1 for one in seen.instances)
        assert any(one.mask is not None for one in seen.instances)


@pytest.mark.parametrize("backend", ["clipseg", "owlv2"])
def test_a_missing_model_names_source_and_folder(tmp_path, backend):
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(config(backend), tmp_path)
    name = config(backend).model
    assert f"https://huggingface.co/{name}" in str(caught.value)
    assert f'"hf download {name} --local-dir {tmp_path}' in str(caught.value)
    assert "Without it `ippon demo`" in str(caught.value)


def test_the_model_of_another_owner_is_not_taken_for_that_of_its_name(folder, tmp_path):
    shutil.copytree(folder / "clipseg-tiny", tmp_path / "clipseg-tiny")
    (tmp_path / "clipseg-tiny" / "hub-name.txt").write_text("another-hub/clipseg-tiny\n")
    with pytest.raises(CheckpointError, match="some-hub/clipseg-tiny are not on this machine") as e:
        load_segmenter(config("clipseg"), tmp_path)
    assert f"--local-dir {tmp_path / 'some-hub--clipseg-tiny'}" in str(e.value)


def test_a_folder_of_another_model_is_refused(folder):
    wrong = SegmentationConfig(backend="clipseg", model=str(folder / "owlv2-tiny"), device="cpu")
    with pytest.raises(CheckpointError, match=r"is (another model|no folder of such a model)"):
        load_segmenter(wrong, folder)


def test_a_damaged_folder_is_refused(folder, tmp_path):
    (tmp_path / "clipseg-tiny").mkdir()
    (tmp_path / "clipseg-tiny" / "config.json").write_text(json.dumps({"model_type": "clipseg"}))
    with pytest.raises(CheckpointError, match="clipseg-tiny is not a folder of such a model"):
        load_segmenter(config("clipseg"), tmp_path)


def test_a_network_for_every_pixel_gets_a_second_pass(folder, image_by_formula):
    segmenter = load_segmenter(config("clipseg", small_objects=True), folder)
    heatmap = segmenter.segment(image_by_formula(48, 64), LABELS, "hat")
    assert (heatmap.labels, heatmap.kind, heatmap.source) == (LABELS, "scores", "clipseg")
    assert heatmap.probabilities.shape[2] == 4


def test_without_torch_the_extra_is_named(tmp_path, monkeypatch):
    import importlib

    real = importlib.import_module

    def absent(name, *rest):
        if name == "torch":
            raise ModuleNotFoundError("No module named 'torch'", name="torch")
        return real(name, *rest)

    monkeypatch.setattr(importlib, "import_module", absent)
    with pytest.raises(MissingPackageError) as caught:
        load_segmenter(SegmentationConfig(), tmp_path)
    assert 'networks need torch: pip install "ippon[segmentation]"' in str(caught.value)
    assert "https://download.pytorch.org/whl/cpu" in str(caught.value)
