"""Networks that are known by name."""

import pytest

from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.model_registry import (
    DEFAULT_MASK_MODELS,
    DEFAULT_MODELS,
    MODELS,
    NAME_FILE,
    model_folder,
    models_of,
    terms_of,
)


def test_the_terms_of_usual_models_are_known():
    assert {*DEFAULT_MODELS.values(), *DEFAULT_MASK_MODELS.values()} <= set(MODELS)
    assert terms_of("facebook/sam2.1-hiera-tiny") == " (160 MB, Apache 2.0)"
    assert terms_of("somebody/else") == ""


@pytest.mark.parametrize(
    ("fields", "models"),
    [
        ({"backend": "san", "model": "san_vit_b_16"}, ()),
        ({"backend": "clipseg"}, (DEFAULT_MODELS["clipseg"],)),
        ({"backend": "sam3", "model": "folder"}, ("folder",)),
        ({"backend": "owlv2"}, (DEFAULT_MODELS["owlv2"], DEFAULT_MASK_MODELS["owlv2"])),
        ({"backend": "grounding-dino", "masks_model": "none"}, (DEFAULT_MODELS["grounding-dino"],)),
        (
            {"backend": "grounding-dino", "model": "a/b", "masks_model": "yonigozlan/EdgeTAM-hf"},
            ("a/b", "yonigozlan/EdgeTAM-hf"),
        ),
    ],
)
def test_a_configuration_takes_these_models(fields, models):
    assert models_of(SegmentationConfig(**fields)) == models


def test_a_folder_belongs_to_the_model_that_it_was_fetched_for(tmp_path):
    tiny = tmp_path / "tiny"
    assert model_folder("some/tiny", tmp_path) == tiny
    tiny.mkdir()
    assert model_folder("some/tiny", tmp_path) == tiny, "put there by hand"
    (tiny / NAME_FILE).write_text("some/tiny\n")
    assert model_folder("some/tiny", tmp_path) == tiny
    assert model_folder("other/tiny", tmp_path) == tmp_path / "other--tiny"
    assert model_folder("tiny", tmp_path) == tiny
