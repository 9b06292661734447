"""Grounding DINO: boxes for words."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from transformers import GroundingDinoForObjectDetection, MMGroundingDinoForObjectDetection

from ippon.observation import Detections
from ippon.segmentation.backends.boxes import labelled_boxes
from ippon.segmentation.backends.pretrained import IMAGENET_MEAN, IMAGENET_STD, Pretrained
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.device import choose_device, choose_dtype, memory_guard
from ippon.segmentation.errors import CheckpointError
from ippon.segmentation.label_probabilities import as_tensor, normalised, resized
from ippon.segmentation.model_registry import DEFAULT_MODELS
from ippon.segmentation.prompts import words_of
from ippon.segmentation.segmenter import checked_channels

LEAST_SCORE: Final = 0.1
"""Least score of a box; the default observation model gives no evidence up to 0.25."""
SHORTEST_PX: Final = 800
LONGEST_PX: Final = 1333
"""Sides of the training images, unless the model's files state others."""
_KINDS: Final[dict[str, Any]] = {
    "mm-grounding-dino": MMGroundingDinoForObjectDetection,
    "grounding-dino": GroundingDinoForObjectDetection,
}


@dataclass(frozen=True, slots=True)
class _Text:
    """Labels as one input text, each followed by a full stop."""

    tokens: Tensor
    """(1, T) int64."""
    spans: tuple[slice, ...]
    """Tokens of each label."""
    channels: tuple[int, ...]
    """Number of each label."""


class GroundingDinoSegmenter:
    """MM-Grounding-DINO (Zhao et al., 2024), Grounding DINO (Liu et al., ECCV 2024), or LLMDet.

    Implements `Segmenter`. Labels that fit into the network's 256 tokens take one pass; more labels
    take more passes.
    """

    source = "grounding-dino"

    def __init__(self, config: SegmentationConfig, folder: Path) -> None:
        """Load the model.

        Raises:
            CheckpointError: The model is not on this machine, or is of another type.
        """
        files = Pretrained(model=config.model or DEFAULT_MODELS["grounding-dino"], folder=folder)
        self.device = choose_device(config.device)
        self.dtype = choose_dtype(config.precision, self.device)
        # Loading rejects other types and names the expected ones.
        model: Any = files.load(_KINDS.get(files.kind, MMGroundingDinoForObjectDetection), *_KINDS)
        self._tokenizer = files.tokenizer()
        self._normalisation = files.normalisation(IMAGENET_MEAN, IMAGENET_STD)
        said = files.preprocessing().get("size", {})
        self._sides = said.get("shortest_edge", SHORTEST_PX), said.get("longest_edge", LONGEST_PX)
        self._stop, begin, end = self._tokenizer.convert_tokens_to_ids([".", "[CLS]", "[SEP]"])
        known = set(model.model.special_tokens.tolist())
        if not {self._stop, begin, end} <= known:
            raise CheckpointError(
                f"{files.source} holds the tokenizer of another model: its full stop, [CLS] and "
                f"[SEP] are {self._stop}, {begin} and {end}; the network knows {sorted(known)}"
            )
        self._ends = begin, end
        with memory_guard("moving Grounding DINO to its device"):
            self._model = model.to(self.device, self.dtype)
        if config.compile:
            self._model.model.backbone = torch.compile(self._model.model.backbone)
        self._words: dict[str, list[int]] = {}

    def segment(
        self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None
    ) -> Detections:
        """Find the instances of each label; see `Segmenter.segment`."""
        channels = checked_channels(color, labels, ooi)
        height, width = color.shape[:2]
        with torch.inference_mode(), memory_guard(f"Grounding DINO on {width}x{height} pixels"):
            boxes, scores = self.find(color, channels)
            return labelled_boxes(
                boxes * boxes.new_tensor([width, height, width, height]),
                scores,
                LEAST_SCORE,
                source=self.source,
                channels=channels,
                ooi=ooi,
                image_size=(height, width),
            )

    def find(self, color: NDArray[np.uint8], channels: tuple[str, ...]) -> tuple[Tensor, Tensor]:
        """Return boxes and their scores.

        Args:
            color: (H, W, 3) uint8 RGB.
            channels: One label per channel.

        Returns:
            (N, 4) left, top, right, bottom as shares of the image; (N, C) score of each label, 0 to
            1: the mean over its tokens, all of which the training matches to the object. 0 for
            labels in another text than the box's.
        """
        image = self._prepare(color)
        parts = [self._decode(image, text, len(channels)) for text in self._texts(channels)]
        return torch.cat([boxes for boxes, _ in parts]), torch.cat([fits for _, fits in parts])

    def _decode(self, image: Tensor, text: _Text, count: int) -> tuple[Tensor, Tensor]:
        given = self._model(pixel_values=image, input_ids=text.tokens)
        each = given.logits[0].float().sigmoid()
        fits = each.new_zeros(len(each), count)
        for span, channel in zip(text.spans, text.channels, strict=True):
            fits[:, channel] = each[:, span].mean(dim=1)
        middle, extent = given.pred_boxes[0].float().split(2, dim=-1)
        return torch.cat([middle - extent / 2, middle + extent / 2], dim=-1), fits

    def _texts(self, channels: tuple[str, ...]) -> list[_Text]:
        """Group labels into texts of the network's length."""
        room = self._model.config.max_text_len - 2
        texts: list[_Text] = []
        tokens: list[int] = []
        spans: list[slice] = []
        first = 0
        for number, name in enumerate(channels):
            words = self._tokens_of(name)[: room - 1]
            if len(tokens) + len(words) + 1 > room:
                texts.append(self._text(tokens, spans, first))
                tokens, spans, first = [], [], number
            # After the start token.
            spans.append(slice(len(tokens) + 1, len(tokens) + 1 + len(words)))
            tokens += [*words, self._stop]
        return [*texts, self._text(tokens, spans, first)]

    def _text(self, tokens: list[int], spans: list[slice], first: int) -> _Text:
        begin, end = self._ends
        return _Text(
            tokens=torch.tensor([[begin, *tokens, end]], device=self.device),
            spans=tuple(spans),
            channels=tuple(range(first, first + len(spans))),
        )

    def _tokens_of(self, name: str) -> list[int]:
        if name not in self._words:
            # Full stops and question marks would split the label.
            words = words_of(name).lower().replace(".", " ").replace("?", " ")
            self._words[name] = self._tokenizer(words, add_special_tokens=False)["input_ids"]
        # A label without any known character becomes the unknown token.
        return self._words[name] or [self._tokenizer.unk_token_id]

    def _prepare(self, color: NDArray[np.uint8]) -> Tensor:
        image = as_tensor(color, self.device)
        size = fitted_size((color.shape[0], color.shape[1]), *self._sides)
        seen = resized(image, size)
        return normalised(seen, *self._normalisation).to(self.dtype)


def fitted_size(shape: tuple[int, int], shortest: int, longest: int) -> tuple[int, int]:
    """Return the size of an (H, W) image resized to a shorter side.

    It is smaller if the longer side would exceed `longest`.
    """
    small, large = min(shape), max(shape)
    side = min(float(shortest), longest * small / large)
    least, most = max(1, round(side)), max(1, int(side * large / small))
    return (least, most) if shape[0] <= shape[1] else (most, least)
