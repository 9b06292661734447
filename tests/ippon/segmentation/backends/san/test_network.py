"""SAN computes what the authors' implementation computes, from the same weights.

`san_reference.json` was recorded by running the reference implementation (github.com/MendelXu/SAN,
commit e19262d, with open_clip 2.16.0 and timm 0.6.13, torch 2.13.0 on a CPU in float32) on the
weights and images of `conftest.formula_weights` and `formula_image`: text embeddings of three
token rows, class logits, mask logits and the scores per pixel, of a tiny architecture in full and
of the released ones every `step`-th value; and digests of the names and shapes of the weights of
the released models.
"""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from ippon.segmentation.backends.san.architecture import RELEASED, SanArchitecture
from tests import later

# torch and transformers take seconds to load.
pytestmark = pytest.mark.slow

later.needs("torch", extra="segmentation")
torch = later.module("torch")
network_of = later.names("ippon.segmentation.backends.san.checkpoint", "network_of")
SanNetwork, normalised = later.names(
    "ippon.segmentation.backends.san.network", "SanNetwork", "normalised"
)

REFERENCE = json.loads((Path(__file__).parent / "san_reference.json").read_text())
TINY = SanArchitecture(
    clip_layers=4,
    clip_width=16,
    clip_heads=2,
    clip_patch_px=4,
    clip_image_px=16,
    clip_scale=0.5,
    recognition_from=3,
    embedding_width=12,
    text_layers=2,
    text_width=12,
    text_heads=2,
    side_layers=3,
    side_width=12,
    side_heads=2,
    side_image_px=64,
    fusion=(0, 1, 3),
    queries=5,
    mask_width=8,
)
TOLERANCE = 1e-4


def shapes_of(architecture):
    with torch.device("meta"):
        state = SanNetwork(architecture).state_dict()
    return {name: tuple(tensor.shape) for name, tensor in state.items()}


def outputs(architecture, expected, weights_by_formula, image_by_formula):
    shapes = shapes_of(architecture)
    del shapes["ov_classifier.attn_mask"]
    state = {k: torch.from_numpy(np.asarray(v)) for k, v in weights_by_formula(shapes).items()}
    network = network_of(state, architecture, "formula")
    tokens = torch.zeros(3, architecture.text_context, dtype=torch.long)
    for row, numbers in zip(tokens, REFERENCE["tokens"], strict=True):
        row[: len(numbers)] = torch.tensor(numbers)
    height, width = expected["size"]
    image = torch.from_numpy(image_by_formula(height, width)).permute(2, 0, 1)[None].float()
    with torch.inference_mode():
        text = network.ov_classifier.embed(tokens)
        padded = torch.nn.functional.pad(normalised(image), (0, -width % 32, 0, -height % 32))
        class_logits, masks = network(padded, network.ov_classifier.weights(text))
        full = torch.nn.functional.interpolate(masks, size=padded.shape[2:], mode="bilinear")
        scores = torch.einsum(
            "qc,qhw->chw",
            class_logits[0].softmax(-1)[:, :-1],
            full[0, :, :height, :width].sigmoid(),
        )
    return {
        "text": text,
        "class_logits": class_logits,
        "mask_logits": masks,
        "scores": scores[:, ::8, ::8],
    }


@pytest.mark.parametrize(
    "name",
    [
        "tiny",
        pytest.param("san_vit_b_16", marks=pytest.mark.slow),
        pytest.param("san_vit_large_14", marks=pytest.mark.large),
    ],
)
def test_it_agrees_with_the_reference_implementation(name, weights_by_formula, image_by_formula):
    expected = REFERENCE[name]
    architecture = TINY if name == "tiny" else RELEASED[name]
    found = outputs(architecture, expected, weights_by_formula, image_by_formula)
    for what, tensor in found.items():
        values = tensor.numpy().ravel()[:: expected["step"]]
        np.testing.assert_allclose(values, expected[what], atol=TOLERANCE, rtol=0, err_msg=what)
    # The recorded values must be able to tell networks apart.
    assert np.std(expected["class_logits"]) > 100 * TOLERANCE
    assert np.std(expected["mask_logits"]) > 1000 * TOLERANCE


@pytest.mark.parametrize("name", RELEASED)
def test_weights_bear_the_names_of_the_released_checkpoints(name):
    lines = "\n".join(f"{k} {list(s)}" for k, s in sorted(shapes_of(RELEASED[name]).items()))
    assert hashlib.sha256(lines.encode()).hexdigest() == REFERENCE["names"][name]
