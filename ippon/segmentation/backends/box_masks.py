"""Masks of the objects in boxes, by SAM, SAM 2 or EdgeTAM."""

from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional
from transformers import EdgeTamModel, Sam2Model, SamModel

from ippon.observation import Detections
from ippon.segmentation.backends.instance_masks import mask_arrays, resized_masks
from ippon.segmentation.backends.pretrained import IMAGENET_MEAN, IMAGENET_STD, Pretrained
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.device import choose_device, choose_dtype, memory_guard
from ippon.segmentation.errors import MissingPackageError
from ippon.segmentation.label_probabilities import as_tensor, normalised, resized
from ippon.segmentation.segmenter import heatmap_size

MOST_MASKS: Final = 64
"""Most instances that get a mask, best scores first; the others keep their box."""
EDGETAM_PACKAGES: Final = ("timm", "torchvision")
"""Packages of EdgeTAM's image encoder."""
_KINDS: Final[dict[str, Any]] = {
    "sam": SamModel,
    "sam2": Sam2Model,
    "sam2_video": Sam2Model,
    "edgetam": EdgeTamModel,
    "edgetam_video": EdgeTamModel,
}


class BoxSegmenter(Protocol):
    """A segmenter that returns instances."""

    def segment(
        self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None
    ) -> Detections:
        """Find the instances of each label; see `Segmenter.segment`."""
        ...


class BoxMasks:
    """SAM (Kirillov et al., ICCV 2023), SAM 2 (Ravi et al., 2024) or EdgeTAM (Zhou et al., 2025).

    Segments the object in each of some boxes.
    """

    def __init__(self, model: str, config: SegmentationConfig, folder: Path) -> None:
        """Load the model.

        Args:
            model: Name or folder.
            config: Device and precision.
            folder: Folder of models that are given by name.

        Raises:
            CheckpointError: The model is not on this machine, or is of another type.
            MissingPackageError: EdgeTAM's packages are not installed.
        """
        files = Pretrained(model=model, folder=folder)
        kind = files.kind
        if kind.startswith("edgetam") and not all(map(find_spec, EDGETAM_PACKAGES)):
            raise MissingPackageError(
                f"EdgeTAM ({files.source}) needs more packages: pip install "
                f"{' '.join(EDGETAM_PACKAGES)}; SAM 2 does without them"
            )
        self.device = choose_device(config.device)
        self.dtype = choose_dtype(config.precision, self.device)
        # The first SAM keeps the proportions of images; later ones stretch them to a square.
        self._keeps_proportions = kind == "sam"
        self._normalisation = files.normalisation(IMAGENET_MEAN, IMAGENET_STD)
        # Loading rejects other types and names the expected ones.
        loaded: Any = files.load(_KINDS.get(kind, SamModel), *_KINDS)
        self._side = int(np.ravel(loaded.config.prompt_encoder_config.image_size)[0])
        with memory_guard("moving the network for masks to its device"):
            self._model = loaded.to(self.device, self.dtype)
        if config.compile:
            self._model.vision_encoder = torch.compile(self._model.vision_encoder)

    def outline(
        self, color: NDArray[np.uint8], boxes_px: NDArray[np.float64], size: tuple[int, int]
    ) -> Tensor:
        """Return the mask of the object in each box.

        Args:
            color: (H, W, 3) uint8 RGB.
            boxes_px: (K, 4) left, top, right, bottom in pixels; K at least 1.
            size: (h, w) of the masks.

        Returns:
            (K, h, w) bool.
        """
        height, width = color.shape[:2]
        image = as_tensor(color, self.device)
        side = self._side
        scale = side / max(height, width)
        h, w = (
            (max(1, round(height * scale)), max(1, round(width * scale)))
            if self._keeps_proportions
            else (side, side)
        )
        seen = normalised(resized(image, (h, w)), *self._normalisation)
        # Boxes stay float32: at 1024 pixels a bfloat16 is 4 pixels apart from the next.
        factor = torch.tensor([w / width, h / height] * 2, device=self.device)
        given = self._model(
            pixel_values=functional.pad(seen, (0, side - w, 0, side - h)).to(self.dtype),
            input_boxes=(torch.from_numpy(boxes_px).to(factor) * factor)[None],
            multimask_output=False,
        )
        logits = given.pred_masks[0, :, 0].float()
        full = max(size[0], round(size[0] * side / h)), max(size[1], round(size[1] * side / w))
        return resized_masks(logits, full)[:, : size[0], : size[1]] > 0.0


class OutlinedSegmenter:
    """A segmenter whose instances get masks; implements `Segmenter`."""

    def __init__(self, segmenter: BoxSegmenter, masks: BoxMasks, longest_side_px: int) -> None:
        self._segmenter = segmenter
        self._masks = masks
        self._longest_side_px = longest_side_px

    def segment(
        self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None
    ) -> Detections:
        """Find the instances of each label, with masks; see `Segmenter.segment`."""
        return self.outlined(color, self._segmenter.segment(color, labels, ooi))

    def outlined(self, color: NDArray[np.uint8], seen: Detections) -> Detections:
        """Return the instances of an (H, W, 3) uint8 RGB image with masks."""
        bare = [k for k, one in enumerate(seen.instances) if one.mask is None][:MOST_MASKS]
        if not bare:
            return seen
        height, width = color.shape[:2]
        size = heatmap_size((height, width), self._longest_side_px)
        boxes = np.array([seen.instances[k].box_px for k in bare])
        with torch.inference_mode(), memory_guard(f"masks of an image of {width}x{height}"):
            masks = mask_arrays(self._masks.outline(color, boxes, size))
        instances = list(seen.instances)
        for k, mask in zip(bare, masks, strict=True):
            instances[k] = replace(instances[k], mask=mask)
        return replace(seen, instances=tuple(instances))
