"""Models of `transformers`: size and licence, defaults of the backends, and their folders."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ippon.segmentation.config import SegmentationConfig


@dataclass(frozen=True, slots=True)
class ModelInfo:
    """Size and licence of a model."""

    megabytes: int
    """Size of the weights in float32, without unused video parts."""
    licence: str


MODELS: Final = {
    "facebook/sam3": ModelInfo(3360, "SAM License; access is granted on its page"),
    "yonigozlan/sam3-litetext-s0": ModelInfo(2190, "SAM License"),
    "openmmlab-community/mm_grounding_dino_tiny_o365v1_goldg_v3det": ModelInfo(690, "Apache 2.0"),
    "IDEA-Research/grounding-dino-tiny": ModelInfo(690, "Apache 2.0"),
    "facebook/sam2.1-hiera-tiny": ModelInfo(160, "Apache 2.0"),
    "yonigozlan/EdgeTAM-hf": ModelInfo(60, "Apache 2.0"),
    "facebook/sam-vit-base": ModelInfo(380, "Apache 2.0"),
    "google/owlv2-base-patch16-ensemble": ModelInfo(620, "Apache 2.0"),
    "CIDAS/clipseg-rd64-refined": ModelInfo(610, "Apache 2.0"),
}
DEFAULT_MODELS: Final = {
    "clipseg": "CIDAS/clipseg-rd64-refined",
    "owlv2": "google/owlv2-base-patch16-ensemble",
    "sam3": "facebook/sam3",
    "sam3-lite": "yonigozlan/sam3-litetext-s0",
    "grounding-dino": "openmmlab-community/mm_grounding_dino_tiny_o365v1_goldg_v3det",
}
"""Default model of each backend."""
DEFAULT_MASK_MODELS: Final = {
    "owlv2": "facebook/sam-vit-base",
    "grounding-dino": "facebook/sam2.1-hiera-tiny",
}
"""Default network for masks of each backend; other backends have none."""
NO_MASKS: Final = "none"
NAME_FILE: Final = "hub-name.txt"
"""File in the folder of a model that was fetched: its full name on the hub."""


def masks_model_of(config: SegmentationConfig) -> str | None:
    """Return name or folder of the network for masks; None without one."""
    model = config.masks_model or DEFAULT_MASK_MODELS.get(config.backend, NO_MASKS)
    return None if model == NO_MASKS else model


def models_of(config: SegmentationConfig) -> tuple[str, ...]:
    """Return names or folders of the `transformers` models of a configuration."""
    own = (
        (config.model or DEFAULT_MODELS[config.backend],)
        if config.backend in DEFAULT_MODELS
        else ()
    )
    takes_masks = config.backend == "detector" or config.backend in DEFAULT_MASK_MODELS
    masks = masks_model_of(config) if takes_masks else None
    return own if masks is None else (*own, masks)


def model_folder(name: str, folder: Path) -> Path:
    """Return where a model lies, or is put, in the folder of models.

    Args:
        name: Name on the hub, `owner/model`, or its last part.
        folder: Folder of the models.

    Returns:
        The folder of the last part of the name; `owner--model` where that one holds the model of
        another owner. A folder without `NAME_FILE` was not fetched by us: it is taken for both.
    """
    owner, model = Path(name).parent, Path(name).name
    holds = folder / model / NAME_FILE
    if owner.name and holds.is_file() and holds.read_text(encoding="utf-8").strip() != name:
        return folder / f"{owner.name}--{model}"
    return folder / model


def terms_of(name: str) -> str:
    """Return size and licence of a model as ` (690 MB, Apache 2.0)`; empty if unknown."""
    known = MODELS.get(name)
    return "" if known is None else f" ({known.megabytes} MB, {known.licence})"
