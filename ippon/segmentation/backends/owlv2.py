"""OWLv2: boxes for words."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional
from transformers import Owlv2ForObjectDetection

from ippon.observation import Detections
from ippon.segmentation.backends.boxes import labelled_boxes
from ippon.segmentation.backends.pretrained import (
    CLIP_MEAN,
    CLIP_STD,
    Pretrained,
    tokens_of,
)
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.device import choose_device, choose_dtype, memory_guard
from ippon.segmentation.label_probabilities import as_tensor, normalised, resized
from ippon.segmentation.model_registry import DEFAULT_MODELS
from ippon.segmentation.prompts import PLAIN_TEMPLATES, words_of
from ippon.segmentation.segmenter import checked_channels

LEAST_SCORE: Final = 0.1
"""Least score of a box, as in the authors' code."""
GREY: Final = 127.5


class Owlv2Segmenter:
    """OWLv2 (Minderer et al., NeurIPS 2023); implements `Segmenter`.

    It detects objects, not walls or floors.
    """

    source = "owlv2"

    def __init__(self, config: SegmentationConfig, folder: Path) -> None:
        """Load the model.

        Raises:
            CheckpointError: The model is not on this machine, or is of another type.
        """
        files = Pretrained(model=config.model or DEFAULT_MODELS["owlv2"], folder=folder)
        self.device = choose_device(config.device)
        self.dtype = choose_dtype(config.precision, self.device)
        self._tokenizer = files.tokenizer()
        self._normalisation = files.normalisation(CLIP_MEAN, CLIP_STD)
        model: Any = files.load(Owlv2ForObjectDetection)
        with memory_guard("moving OWLv2 to its device"):
            self._finder = model.to(self.device, self.dtype)
        self._embeddings: dict[str, Tensor] = {}

    def segment(
        self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None
    ) -> Detections:
        """Find the instances of each label; see `Segmenter.segment`."""
        channels = checked_channels(color, labels, ooi)
        height, width = color.shape[:2]
        image = as_tensor(color, self.device)
        with torch.inference_mode(), memory_guard(f"OWLv2 on an image of {width}x{height}"):
            boxes, scores = self.find(image, channels)
            return labelled_boxes(
                boxes,
                scores,
                LEAST_SCORE,
                source=self.source,
                channels=channels,
                ooi=ooi,
                image_size=(height, width),
            )

    def find(self, image: Tensor, channels: tuple[str, ...]) -> tuple[Tensor, Tensor]:
        """Return boxes and their scores.

        Args:
            image: (1, 3, H, W) RGB, 0 to 255.
            channels: One label per channel.

        Returns:
            (N, 4) left, top, right, bottom in pixels, possibly outside the image; (N, C) score of
            each label, 0 to 1.
        """
        finder = self._finder
        longest = max(image.shape[2:])
        below, right = longest - image.shape[2], longest - image.shape[3]
        square = functional.pad(image, (0, right, 0, below), value=GREY)
        side = finder.config.vision_config.image_size
        pixels = normalised(resized(square, (side, side)), *self._normalisation).to(self.dtype)
        features = finder.image_embedder(pixel_values=pixels)[0]
        flat = features.flatten(1, 2)
        texts = self._texts(channels)[None]
        logits = finder.class_predictor(flat, texts)[0][0].float()
        middle, extent = finder.box_predictor(flat, features)[0].float().split(2, dim=-1)
        boxes = torch.cat([middle - extent / 2, middle + extent / 2], dim=-1) * longest
        return boxes, logits.sigmoid()

    def _texts(self, channels: tuple[str, ...]) -> Tensor:
        new = [name for name in channels if name not in self._embeddings]
        if new:
            sentences = [PLAIN_TEMPLATES[0].format(words_of(name)) for name in new]
            length = self._finder.config.text_config.max_position_embeddings
            tokens = tokens_of(self._tokenizer, sentences, length).to(self.device)
            features = self._finder.owlv2.get_text_features(tokens).pooler_output
            self._embeddings.update(zip(new, features, strict=True))
        return torch.stack([self._embeddings[name] for name in channels])
