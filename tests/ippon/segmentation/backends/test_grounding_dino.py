"""Grounding DINO of both makes, on tiny random models, against the library's own results."""

import json

import numpy as np
import pytest

from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import CheckpointError, SegmentationError
from ippon.segmentation.loading import load_segmenter
from ippon.segmentation.model_registry import DEFAULT_MODELS
from tests import later

# torch and transformers take seconds to load.
pytestmark = pytest.mark.slow

later.needs("torch", "transformers", extra="segmentation")
torch = later.module("torch")
transformers = later.module("transformers")
get_size_with_aspect_ratio = later.names(
    "transformers.image_transforms", "get_size_with_aspect_ratio"
)
grounding_dino = later.module("ippon.segmentation.backends.grounding_dino")
GroundingDinoSegmenter, fitted_size = later.names(
    "ippon.segmentation.backends.grounding_dino", "GroundingDinoSegmenter", "fitted_size"
)
tiny_models = later.module("tests.ippon.segmentation.backends.tiny_models")

KINDS = ("mm-grounding-dino", "grounding-dino")
LABELS = ("wall", "chest_of_drawers", "tv", "coffee_table", "lamp")
WORDS = ["wall", "chest of drawers", "television", "coffee table", "lamp"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("models")
    for kind in KINDS:
        tiny_models.save_grounding_dino(root / kind, kind)
    return root


def config(model, **fields):
    fields = {"masks_model": "none", "device": "cpu"} | fields
    return SegmentationConfig(backend="grounding-dino", model=str(model), **fields)


@pytest.fixture(params=KINDS)
def segmenter(request, folder):
    return GroundingDinoSegmenter(config(request.param), folder)


@pytest.fixture
def processor(segmenter):
    images = transformers.GroundingDinoImageProcessorPil(
        size={"shortest_edge": 96, "longest_edge": 160}
    )
    return transformers.GroundingDinoProcessor(images, segmenter._tokenizer)


def test_the_text_is_that_of_the_librarys_processor(segmenter, processor, image_by_formula):
    inputs = processor(images=image_by_formula(48, 64), text=[WORDS], return_tensors="pt")
    (text,) = segmenter._texts(LABELS)
    assert text.tokens.tolist() == inputs["input_ids"].tolist()


def test_boxes_and_scores_are_those_of_the_librarys_processor(
    segmenter, processor, image_by_formula
):
    """Of labels of one word, since the library's score is that of the best token."""
    color, labels = image_by_formula(48, 64), ("wall", "tv", "lamp", "cup")
    (text,) = segmenter._texts(labels)
    with torch.inference_mode():
        boxes, fits = segmenter.find(color, labels)
        outputs = segmenter._model(pixel_values=segmenter._prepare(color), input_ids=text.tokens)
    # Full stops score, too, in the library, and are no label.
    marks = torch.ones(outputs.logits.shape[2], dtype=torch.bool)
    marks[[span.start for span in text.spans]] = False
    outputs.logits = outputs.logits.clone()
    outputs.logits[..., marks] = -torch.inf
    (theirs,) = processor.post_process_grounded_object_detection(
        outputs,
        input_ids=text.tokens,
        threshold=-1.0,
        text_threshold=float(fits.max(dim=1).values.min()) - 1e-6,
        target_sizes=[(48, 64)],
    )
    extent = torch.tensor([64, 48, 64, 48])
    torch.testing.assert_close(boxes * extent, theirs["boxes"], atol=1e-3, rtol=1e-4)
    torch.testing.assert_close(fits.max(dim=1).values, theirs["scores"])
    for words, best in zip(theirs["text_labels"], fits.argmax(dim=1).tolist(), strict=True):
        assert labels[best].replace("tv", "television") in words


def test_a_label_fits_as_well_as_its_words_on_average(segmenter, image_by_formula):
    color = image_by_formula(48, 64)
    (text,) = segmenter._texts(LABELS)
    with torch.inference_mode():
        _, fits = segmenter.find(color, LABELS)
        given = segmenter._model(pixel_values=segmenter._prepare(color), input_ids=text.tokens)
    each = given.logits[0].sigmoid()
    # [CLS] wall . chest of drawers . television . coffee table .
    torch.testing.assert_close(fits[:, 1], (each[:, 3] + each[:, 4] + each[:, 5]) / 3)
    torch.testing.assert_close(fits[:, 3], (each[:, 9] + each[:, 10]) / 2)
    assert fits.std() > 1e-3


def test_images_are_prepared_as_the_librarys_processor_does(segmenter, processor, image_by_formula):
    for shape in ((48, 64), (64, 48), (30, 120)):
        color = image_by_formula(*shape)
        theirs = processor(images=color, text="wall.", return_tensors="pt")["pixel_values"]
        # Pillow rounds to whole grey values in between; one is 1/255/0.224.
        torch.testing.assert_close(segmenter._prepare(color), theirs, atol=0.036, rtol=0.0)


def test_sizes_are_the_librarys():
    generator = np.random.default_rng(0)
    for height, width in generator.integers(16, 2500, (300, 2)).tolist():
        assert fitted_size((height, width), 800, 1333) == get_size_with_aspect_ratio(
            (height, width), 800, 1333
        )


def test_detections_lie_in_the_image_and_carry_the_labels(segmenter, image_by_formula):
    found = 0
    for size in ((48, 64), (70, 50), (40, 90)):
        seen = segmenter.segment(image_by_formula(*size), LABELS, "cup")
        assert (seen.labels, seen.ooi, seen.image_size) == ((*LABELS, "cup"), "cup", size)
        assert seen.source == "grounding-dino"
        found += len(seen.instances)
        for one in seen.instances:
            left, top, right, bottom = one.box_px
            assert 0 <= left < right <= size[1]
            assert 0 <= top < bottom <= size[0]
            assert grounding_dino.LEAST_SCORE < one.score <= 1
            assert one.mask is None
    assert found > 0


@pytest.mark.slow
def test_labels_that_one_text_does_not_hold_take_several(segmenter, image_by_formula):
    many = (*(f"coffee_table_{'lamp_' * k}cup" for k in range(12)), *LABELS)
    texts = segmenter._texts(many)
    room = segmenter._model.config.max_text_len
    assert len(texts) > 1
    assert [c for text in texts for c in text.channels] == list(range(len(many)))
    for text in texts:
        assert text.tokens.shape[1] <= room
        for span, channel in zip(text.spans, text.channels, strict=True):
            words = segmenter._tokenizer.decode(text.tokens[0, span])
            assert words.replace(" ", "_") == many[channel].replace("tv", "television")
    with torch.inference_mode():
        boxes, fits = segmenter.find(image_by_formula(48, 64), many)
    assert boxes.shape == (20 * len(texts), 4)
    assert fits.shape == (20 * len(texts), len(many))
    # A box has no scores for labels of other texts.
    assert (fits[:20, texts[1].channels[0] :] == 0).all()
    seen = segmenter.segment(image_by_formula(48, 64), many, "cup")
    assert seen.labels == (*many, "cup")


def test_marks_within_a_label_do_not_end_it(segmenter):
    (text,) = segmenter._texts(("lamp. cup?", "☃", "wall"))
    first, unknown, last = text.spans
    decode = segmenter._tokenizer.decode
    assert decode(text.tokens[0, first]) == "lamp cup"
    assert decode(text.tokens[0, unknown]) == "[UNK]"
    assert decode(text.tokens[0, last]) == "wall"
    long = segmenter._texts(("lamp_" * 100, "cup"))
    assert [text.tokens.shape[1] for text in long] == [40, 4]


def test_nan_is_rejected(segmenter, image_by_formula):
    with torch.no_grad():
        for values in segmenter._model.model.decoder.layer_norm.parameters():
            values.fill_(float("nan"))
    with pytest.raises(SegmentationError, match="values that are not numbers; try --segmentation"):
        segmenter.segment(image_by_formula(48, 64), LABELS, None)


def test_a_missing_model_names_its_source(tmp_path):
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(config(""), tmp_path)
    assert f"https://huggingface.co/{DEFAULT_MODELS['grounding-dino']}" in str(caught.value)


def test_another_architecture_is_refused(folder, tmp_path):
    (tmp_path / "config.json").write_text(json.dumps({"model_type": "detr"}))
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(config(tmp_path), folder)
    assert str(caught.value).endswith(
        "is another model: its config.json says 'detr'; expected 'mm-grounding-dino' or "
        "'grounding-dino'"
    )


@pytest.mark.slow
def test_a_tokenizer_with_other_numbers_is_refused(folder, tmp_path):
    where = tmp_path / "mixed"
    where.mkdir()
    for name in ("config.json", "model.safetensors"):
        (where / name).write_bytes((folder / KINDS[0] / name).read_bytes())
    tokens = ["[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", ".", *tiny_models.WORDS]
    numbers = {token: k for k, token in enumerate(tokens)}
    transformers.BertTokenizer(vocab=numbers).save_pretrained(where)
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(config(where), folder)
    assert str(caught.value) == (
        f"{where} holds the tokenizer of another model: its full stop, [CLS] and [SEP] are 5, 2 "
        "and 3; the network knows [101, 102, 1012, 1029]"
    )
