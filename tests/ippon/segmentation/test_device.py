"""Every network on a GPU and compiled, on tiny random models, against the same on the processor."""

import functools

import numpy as np
import pytest

from ippon.observation import Detections
from ippon.segmentation.backends.san.tokenizer import ClipTokenizer
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import OutOfMemoryError, SegmentationError
from ippon.segmentation.loading import load_segmenter
from tests import later
from tests.ippon.segmentation.backends.san.test_random_weights import SMALL

later.needs("torch", "transformers", extra="segmentation")
torch = later.module("torch")
random_network = later.names("ippon.segmentation.backends.san.random_weights", "random_network")
SanSegmenter = later.names("ippon.segmentation.backends.san.segmenter", "SanSegmenter")
choose_device = later.names("ippon.segmentation.device", "choose_device")
tiny_models = later.module("tests.ippon.segmentation.backends.tiny_models")

pytestmark = pytest.mark.slow
WITH_GPU = pytest.mark.skipif("not torch.cuda.is_available()", reason="there is no GPU")
LABELS = ("wall", "chest_of_drawers", "tv", "lamp")
MASKS = {"grounding-dino": "sam2", "owlv2": "sam"}
COMPILED = ("san", "clipseg", "sam3", "sam3-lite", "grounding-dino")
BACKENDS = (*COMPILED, "owlv2")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("models")
    for save, name in (
        (tiny_models.save_clipseg, "clipseg"),
        (tiny_models.save_sam3, "sam3"),
        (tiny_models.save_sam3_lite, "sam3-lite"),
        (tiny_models.save_grounding_dino, "grounding-dino"),
        (tiny_models.save_owlv2, "owlv2"),
        (tiny_models.save_sam, "sam"),
        (tiny_models.save_sam2, "sam2"),
    ):
        save(root / name)
    return root


def load(backend, folder, **fields):
    if backend == "san":
        config = SegmentationConfig(short_side_px=64, longest_side_px=32, **fields)
        return SanSegmenter(random_network(SMALL, 0), ClipTokenizer([]), config)
    config = SegmentationConfig(
        backend=backend,
        model=str(folder / backend),
        masks_model=str(folder / MASKS[backend]) if backend in MASKS else "",
        longest_side_px=32,
        **fields,
    )
    return load_segmenter(config, folder)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("meta", "a device is auto, cpu, cuda or cuda:N; got 'meta'"),
        ("mps", "a device is auto, cpu, cuda or cuda:N; got 'mps'"),
        ("gpu", "a device is auto, cpu, cuda or cuda:N; got 'gpu'"),
        ("cuda:2", "there is no cuda:2: torch sees 2 GPUs, numbered from 0"),
    ],
)
def test_a_device_that_does_not_exist_is_refused(monkeypatch, name, text):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 2)
    with pytest.raises(SegmentationError, match=text):
        choose_device(name)
    assert choose_device("cuda:1").index == 1


def difference(one, other) -> float:
    """Return how far apart two results are: of scores, where instances, of their best ones."""
    assert one.labels == other.labels
    if not isinstance(one, Detections):
        return np.abs(one.probabilities.astype(int) - other.probabilities.astype(int)).max() / 255
    assert one.instances
    assert abs(len(one.instances) - len(other.instances)) <= 0.1 * len(one.instances) + 1
    return max(
        abs(a.score - b.score) for a, b in zip(one.instances[:5], other.instances[:5], strict=True)
    )


@WITH_GPU
@pytest.mark.parametrize("backend", BACKENDS)
def test_single_precision_gives_what_the_processor_gives(backend, folder, image_by_formula):
    color = image_by_formula(48, 64)
    here = load(backend, folder, device="cpu").segment(color, LABELS, "hat")
    there = load(backend, folder, device="cuda", precision="float32").segment(color, LABELS, "hat")
    assert difference(here, there) <= 0.01


@WITH_GPU
@pytest.mark.parametrize("precision", ["auto", "bfloat16"])
@pytest.mark.parametrize("backend", BACKENDS)
def test_half_precision_gives_about_the_same(backend, precision, folder, image_by_formula):
    color = image_by_formula(48, 64)
    here = load(backend, folder, device="cpu").segment(color, LABELS, "hat")
    there = load(backend, folder, precision=precision).segment(color, LABELS, "hat")
    assert difference(here, there) <= 0.1


@WITH_GPU
@pytest.mark.parametrize("backend", COMPILED)
def test_a_compiled_network_gives_about_the_same(backend, folder, image_by_formula):
    color = image_by_formula(48, 64)
    plain = load(backend, folder, precision="float32").segment(color, LABELS, "hat")
    compiled = load(backend, folder, precision="float32", compile=True)
    assert difference(plain, compiled.segment(color, LABELS, "hat")) <= 0.01


def test_san_can_be_compiled(tmp_path, image_by_formula, monkeypatch):
    """All of it but the generation of code, which needs a compiler and takes minutes."""
    color = image_by_formula(48, 64)
    plain = load("san", tmp_path, device="cpu").segment(color, LABELS, "hat")
    compiler = functools.partial(torch.compile, backend="aot_eager")
    monkeypatch.setattr("torch.compile", compiler)
    compiled = load("san", tmp_path, device="cpu", compile=True).segment(color, LABELS, "hat")
    assert difference(plain, compiled) <= 0.01


@WITH_GPU
def test_images_that_do_not_fit_into_memory_are_an_error_and_the_next_is_segmented(
    folder, image_by_formula
):
    segmenter = load("clipseg", folder)
    torch.cuda.empty_cache()
    room = torch.cuda.memory_allocated() + (8 << 20)
    torch.cuda.set_per_process_memory_fraction(
        room / torch.cuda.get_device_properties(0).total_memory
    )
    try:
        with pytest.raises(OutOfMemoryError, match="short-side-px"):
            segmenter.segment(image_by_formula(2048, 2048), LABELS, "hat")
    finally:
        torch.cuda.set_per_process_memory_fraction(1.0)
    assert segmenter.segment(image_by_formula(48, 64), LABELS, "hat").labels == LABELS
