"""Networks that are known by name."""

import pytest

from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.published import PUBLISHED, USUAL, USUAL_MASKS, models_of, terms_of


def test_the_terms_of_usual_models_are_known():
    assert {*USUAL.values(), *USUAL_MASKS.values()} <= set(PUBLISHED)
    assert terms_of("facebook/sam2.1-hiera-tiny") == " (160 MB, Apache 2.0)"
    assert terms_of("somebody/else") == ""


@pytest.mark.parametrize(
    ("fields", "models"),
    [
        ({"backend": "san", "model": "san_vit_b_16"}, ()),
        ({"backend": "clipseg"}, (USUAL["clipseg"],)),
        ({"backend": "sam3", "model": "folder"}, ("folder",)),
        ({"backend": "owlv2"}, (USUAL["owlv2"], USUAL_MASKS["owlv2"])),
        ({"backend": "grounding-dino", "masks_model": "none"}, (USUAL["grounding-dino"],)),
        (
            {"backend": "grounding-dino", "model": "a/b", "masks_model": "yonigozlan/EdgeTAM-hf"},
            ("a/b", "yonigozlan/EdgeTAM-hf"),
        ),
    ],
)
def test_a_configuration_takes_these_models(fields, models):
    assert models_of(SegmentationConfig(**fields)) == models
