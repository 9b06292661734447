"""CLIPSeg: a light network that scores every label separately at each pixel."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional
from transformers import CLIPSegForImageSegmentation

from ippon.observation import Heatmap
from ippon.segmentation.backends.pretrained import (
    IMAGENET_MEAN,
    IMAGENET_STD,
    Pretrained,
    tokens_of,
)
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.device import choose_device, choose_dtype, memory_guard
from ippon.segmentation.label_probabilities import as_tensor, normalised, resized
from ippon.segmentation.model_registry import DEFAULT_MODELS
from ippon.segmentation.prompts import PLAIN_TEMPLATES, words_of
from ippon.segmentation.segmenter import checked_channels, heatmap_size, score_heatmap_of

LABELS_AT_ONCE: Final = 8
"""Labels per run of the decoder; more take more memory."""
SIDE_PX: Final = 352
"""Side of the training images, unless the model's files state another. The image encoder's own size
in `config.json` is that of CLIP, 224."""


class ClipSegSegmenter:
    """Segments images with CLIPSeg (Lüddecke and Ecker, CVPR 2022); implements `Segmenter`."""

    def __init__(self, config: SegmentationConfig, folder: Path) -> None:
        """Load the model.

        Raises:
            CheckpointError: The model is not on this machine, or is not a CLIPSeg.
        """
        files = Pretrained(model=config.model or DEFAULT_MODELS["clipseg"], folder=folder)
        self.device = choose_device(config.device)
        self.dtype = choose_dtype(config.precision, self.device)
        self._config = config
        self._tokenizer = files.tokenizer()
        self._normalisation = files.normalisation(IMAGENET_MEAN, IMAGENET_STD)
        said = files.preprocessing().get("size", SIDE_PX)
        sides = (said["height"], said["width"]) if isinstance(said, dict) else (said, said)
        self._sides: tuple[int, int] = sides
        model: Any = files.load(CLIPSegForImageSegmentation)
        with memory_guard("moving CLIPSeg to its device"):
            self._model = model.to(self.device, self.dtype)
        self._decode = torch.compile(model.decoder) if config.compile else model.decoder
        self._embeddings: dict[str, Tensor] = {}

    def segment(self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None) -> Heatmap:
        """Score each label separately at each pixel; see `Segmenter.segment`."""
        channels = checked_channels(color, labels, ooi)
        height, width = color.shape[:2]
        size = heatmap_size((height, width), self._config.longest_side_px)
        with torch.inference_mode(), memory_guard(f"CLIPSeg on an image of {width}x{height}"):
            conditions = self._conditions(channels)
            logits = self._logits(self._prepare(color), conditions)
            small = functional.interpolate(
                logits[None].float(), size=size, mode="bilinear", align_corners=False
            )[0]
            return score_heatmap_of(small.sigmoid().cpu().numpy(), labels, ooi, "clipseg")

    def _logits(self, image: Tensor, conditions: Tensor) -> Tensor:
        """Return (C, h, w): the image is encoded once, decoded for each label."""
        model = self._model
        seen = model.clip.vision_model(
            pixel_values=image, output_hidden_states=True, interpolate_pos_encoding=True
        )
        # Hidden states begin with the input of the first layer.
        layers = [seen.hidden_states[k + 1] for k in model.extract_layers]
        parts: list[Tensor] = []
        for some in conditions.split(LABELS_AT_ONCE):
            repeated = [layer.expand(len(some), -1, -1) for layer in layers]
            logits = self._decode(repeated, some).logits
            parts.append(logits.reshape(len(some), *logits.shape[-2:]))
        return torch.cat(parts)

    def _conditions(self, channels: tuple[str, ...]) -> Tensor:
        new = [name for name in channels if name not in self._embeddings]
        if new:
            texts = [PLAIN_TEMPLATES[0].format(words_of(name)) for name in new]
            length = self._model.config.text_config.max_position_embeddings
            tokens = tokens_of(self._tokenizer, texts, length).to(self.device)
            features = self._model.clip.get_text_features(tokens).pooler_output
            self._embeddings.update(zip(new, features, strict=True))
        return torch.stack([self._embeddings[name] for name in channels])

    def _prepare(self, color: NDArray[np.uint8]) -> Tensor:
        """Stretch the image to the square of the model's training."""
        square = resized(as_tensor(color, self.device), self._sides)
        return normalised(square, *self._normalisation).to(self.dtype)
