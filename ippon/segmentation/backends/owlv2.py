"""OWLv2 finds boxes for labels, SAM outlines what is in them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional
from transformers import Owlv2ForObjectDetection, SamModel

from ippon.observation import Heatmap
from ippon.segmentation.backends.pretrained import (
    CLIP_MEAN,
    CLIP_STD,
    IMAGENET_MEAN,
    IMAGENET_STD,
    Pretrained,
    tokens_of,
)
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.device import choose_device, choose_dtype, memory_guard
from ippon.segmentation.label_probabilities import normalised, probabilities_of, resized
from ippon.segmentation.prompts import PLAIN_TEMPLATES, words_of
from ippon.segmentation.segmenter import checked_channels, heatmap_of, heatmap_size

USUAL: Final = "google/owlv2-base-patch16-ensemble"
USUAL_MASKS: Final = "facebook/sam-vit-base"
LEAST_SCORE: Final = 0.1
"""Boxes that fit no label better are dropped, as OWLv2's authors do."""
MOST_BOXES: Final = 32
SAME_OVERLAP: Final = 0.7
"""Boxes that share so much of their union are one thing."""
GREY: Final = 127.5


class Owlv2Segmenter:
    """OWLv2 (Minderer et al., NeurIPS 2023) and SAM (Kirillov et al., ICCV 2023).

    Implements `Segmenter`. It finds things, not walls or floors: pixels in no box teach nothing.
    """

    def __init__(self, config: SegmentationConfig, folder: Path) -> None:
        """Load both models.

        Raises:
            CheckpointError: One is not on this machine, or is another model.
        """
        finder = Pretrained(model=config.model or USUAL, folder=folder)
        outliner = Pretrained(model=config.masks_model or USUAL_MASKS, folder=folder)
        self.device = choose_device(config.device)
        self.dtype = choose_dtype(config.precision, self.device)
        self._config = config
        self._tokenizer = finder.tokenizer()
        self._finder_norm = finder.normalisation(CLIP_MEAN, CLIP_STD)
        self._outliner_norm = outliner.normalisation(IMAGENET_MEAN, IMAGENET_STD)
        found: Any = finder.load(Owlv2ForObjectDetection)
        outlined: Any = outliner.load(SamModel)
        with memory_guard("moving OWLv2 and SAM to their device"):
            self._finder = found.to(self.device, self.dtype)
            self._outliner = outlined.to(self.device, self.dtype)
        if config.compile:
            self._outliner.vision_encoder = torch.compile(self._outliner.vision_encoder)
        self._embeddings: dict[str, Tensor] = {}

    def segment(self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None) -> Heatmap:
        """Tell how probable each label is at each pixel; see `Segmenter.segment`."""
        channels = checked_channels(color, labels, ooi)
        height, width = color.shape[:2]
        size = heatmap_size((height, width), self._config.longest_side_px)
        image = torch.from_numpy(np.ascontiguousarray(color)).to(self.device)
        image = image.permute(2, 0, 1)[None].float()
        with torch.inference_mode(), memory_guard(f"OWLv2 on an image of {width}x{height}"):
            boxes, scores = self.find(image, channels)
            missed = torch.ones(len(channels), *size, device=self.device)
            if len(boxes):
                masks = self._outline(image, boxes, size)
                for mask, fit in zip(masks, scores, strict=True):
                    missed *= 1.0 - fit[:, None, None] * mask
            probabilities = probabilities_of(1.0 - missed)
            return heatmap_of(probabilities.cpu().numpy(), labels, ooi)

    def find(self, image: Tensor, channels: tuple[str, ...]) -> tuple[Tensor, Tensor]:
        """Find boxes.

        Args:
            image: (1, 3, H, W) RGB, 0 to 255.
            channels: One label a channel.

        Returns:
            (N, 4) left, top, right, bottom in pixels; (N, C) how well each label fits, 0 to 1.
        """
        finder = self._finder
        longest = max(image.shape[2:])
        below, right = longest - image.shape[2], longest - image.shape[3]
        square = functional.pad(image, (0, right, 0, below), value=GREY)
        side = finder.config.vision_config.image_size
        pixels = normalised(resized(square, (side, side)), *self._finder_norm).to(self.dtype)
        features = finder.image_embedder(pixel_values=pixels)[0]
        flat = features.flatten(1, 2)
        texts = self._texts(channels)[None]
        logits = finder.class_predictor(flat, texts)[0][0].float()
        middle, extent = finder.box_predictor(flat, features)[0].float().split(2, dim=-1)
        boxes = torch.cat([middle - extent / 2, middle + extent / 2], dim=-1) * longest
        scores = logits.sigmoid()
        kept = distinct_boxes(boxes, scores.amax(dim=-1))
        limits = boxes.new_tensor([image.shape[3], image.shape[2]] * 2)
        return boxes[kept].clamp(min=0.0).minimum(limits), scores[kept]

    def _texts(self, channels: tuple[str, ...]) -> Tensor:
        new = [name for name in channels if name not in self._embeddings]
        if new:
            sentences = [PLAIN_TEMPLATES[0].format(words_of(name)) for name in new]
            length = self._finder.config.text_config.max_position_embeddings
            tokens = tokens_of(self._tokenizer, sentences, length).to(self.device)
            features = self._finder.owlv2.get_text_features(tokens).pooler_output
            self._embeddings.update(zip(new, features, strict=True))
        return torch.stack([self._embeddings[name] for name in channels])

    def _outline(self, image: Tensor, boxes: Tensor, size: tuple[int, int]) -> Tensor:
        """Return (N, h, w): how surely each pixel of the heatmap belongs to the thing in a box."""
        side = self._outliner.config.vision_config.image_size
        scale = side / max(image.shape[2:])
        h, w = (max(1, round(s * scale)) for s in image.shape[2:])
        seen = normalised(resized(image, (h, w)), *self._outliner_norm)
        pixels = functional.pad(seen, (0, side - w, 0, side - h)).to(self.dtype)
        outlines = self._outliner(
            pixel_values=pixels,
            input_boxes=(boxes * scale)[None].to(self.dtype),
            multimask_output=False,
        )
        full = (max(size[0], round(size[0] * side / h)), max(size[1], round(size[1] * side / w)))
        masks = functional.interpolate(
            outlines.pred_masks[0].float(), size=full, mode="bilinear", align_corners=False
        )
        return masks[:, 0, : size[0], : size[1]].sigmoid()


def distinct_boxes(boxes: Tensor, scores: Tensor) -> Tensor:
    """Choose boxes, best first, leaving out those that a better one covers.

    Args:
        boxes: (N, 4) left, top, right, bottom.
        scores: (N,).

    Returns:
        (K,) int64 rows, at most `MOST_BOXES`.
    """
    order = [k for k in scores.argsort(descending=True).tolist() if scores[k] >= LEAST_SCORE]
    kept: list[int] = []
    for k in order:
        if len(kept) == MOST_BOXES:
            break
        if not kept or float(_overlaps(boxes[k], boxes[kept]).max()) < SAME_OVERLAP:
            kept.append(k)
    return torch.tensor(kept, dtype=torch.long, device=boxes.device)


def _overlaps(box: Tensor, others: Tensor) -> Tensor:
    """Return (K,) the intersection of a (4,) box with each of (K, 4), over their union."""
    low = torch.maximum(box[:2], others[:, :2])
    high = torch.minimum(box[2:], others[:, 2:])
    shared = (high - low).clamp(min=0.0).prod(dim=-1)
    areas = (others[:, 2:] - others[:, :2]).prod(dim=-1)
    return shared / ((box[2:] - box[:2]).prod() + areas - shared).clamp(min=1e-9)
