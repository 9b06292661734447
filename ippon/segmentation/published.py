"""Networks of `transformers` that are known by name: sizes and licences, and the usual ones."""

from dataclasses import dataclass
from typing import Final

from ippon.segmentation.config import SegmentationConfig


@dataclass(frozen=True, slots=True)
class Published:
    """What one gets, and under which terms."""

    megabytes: int
    """Of the weights in float32, without the video parts that are not used here."""
    licence: str


PUBLISHED: Final = {
    "facebook/sam3": Published(3360, "SAM License; access is granted on its page"),
    "yonigozlan/sam3-litetext-s0": Published(2190, "SAM License"),
    "openmmlab-community/mm_grounding_dino_tiny_o365v1_goldg_v3det": Published(690, "Apache 2.0"),
    "IDEA-Research/grounding-dino-tiny": Published(690, "Apache 2.0"),
    "facebook/sam2.1-hiera-tiny": Published(160, "Apache 2.0"),
    "yonigozlan/EdgeTAM-hf": Published(60, "Apache 2.0"),
    "facebook/sam-vit-base": Published(380, "Apache 2.0"),
    "google/owlv2-base-patch16-ensemble": Published(620, "Apache 2.0"),
    "CIDAS/clipseg-rd64-refined": Published(610, "Apache 2.0"),
}
USUAL: Final = {
    "clipseg": "CIDAS/clipseg-rd64-refined",
    "owlv2": "google/owlv2-base-patch16-ensemble",
    "sam3": "facebook/sam3",
    "sam3-lite": "yonigozlan/sam3-litetext-s0",
    "grounding-dino": "openmmlab-community/mm_grounding_dino_tiny_o365v1_goldg_v3det",
}
"""The model of each backend where none is named."""
USUAL_MASKS: Final = {
    "owlv2": "facebook/sam-vit-base",
    "grounding-dino": "facebook/sam2.1-hiera-tiny",
}
"""The network for masks where none is named; other backends have none."""
NO_MASKS: Final = "none"


def masks_model_of(config: SegmentationConfig) -> str | None:
    """Return name or folder of the network for masks; None where there is to be none."""
    model = config.masks_model or USUAL_MASKS.get(config.backend, NO_MASKS)
    return None if model == NO_MASKS else model


def models_of(config: SegmentationConfig) -> tuple[str, ...]:
    """Return names or folders of the models of `transformers` that a configuration takes."""
    own = (config.model or USUAL[config.backend],) if config.backend in USUAL else ()
    takes_masks = config.backend == "detector" or config.backend in USUAL_MASKS
    masks = masks_model_of(config) if takes_masks else None
    return own if masks is None else (*own, masks)


def terms_of(name: str) -> str:
    """Return size and licence of a model as ` (690 MB, Apache 2.0)`; empty where not known."""
    known = PUBLISHED.get(name)
    return "" if known is None else f" ({known.megabytes} MB, {known.licence})"
