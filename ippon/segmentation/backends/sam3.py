"""SAM 3: instances with mask and score for short phrases."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from transformers import Sam3LiteTextModel, Sam3Model
from transformers.modeling_outputs import BaseModelOutputWithPooling

from ippon.observation import Detections
from ippon.segmentation.backends.boxes import distinct_boxes
from ippon.segmentation.backends.instance_masks import mask_arrays, resized_masks
from ippon.segmentation.backends.pretrained import Pretrained
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.device import choose_device, choose_dtype, memory_guard
from ippon.segmentation.instances import MAX_INSTANCES, make_detections
from ippon.segmentation.label_probabilities import as_tensor, normalised, resized
from ippon.segmentation.model_registry import DEFAULT_MODELS
from ippon.segmentation.prompts import words_of
from ippon.segmentation.segmenter import checked_channels, heatmap_size

HALF: Final = (0.5, 0.5, 0.5)
"""Mean and standard deviation of SAM 3's training images."""
TOKENS: Final = 32
"""Length to which texts are padded, as in training; the light text encoder attends to the
padding."""
LEAST_SCORE: Final = 0.05
"""Least score of an instance; low, because the observation model weighs scores, and not 0, because
each label has 200 queries."""
LABELS_AT_ONCE: Final = {"cuda": 16}
"""Labels per run of the decoder on a kind of device, else `FEW_LABELS`. In float16 an H200 takes
171 ms and 5.7 GB for 41 labels, with 4 at once 351 ms and 2.8 GB."""
FEW_LABELS: Final = 4


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """K instances of some labels."""

    boxes: Tensor
    """(K, 4) left, top, right, bottom as shares of the image."""
    scores: Tensor
    """(K,)."""
    channels: Tensor
    """(K,) int64."""
    masks: Tensor
    """(K, h, w) bool."""


class Sam3Segmenter:
    """SAM 3 (Carion et al., 2025), or its variant with a light text encoder.

    Implements `Segmenter`. Each image is encoded once, and each label once for all images.
    """

    def __init__(self, config: SegmentationConfig, folder: Path) -> None:
        """Load the model.

        Raises:
            CheckpointError: The model is not on this machine, or is of another type.
        """
        light = config.backend == "sam3-lite"
        files = Pretrained(model=config.model or DEFAULT_MODELS[config.backend], folder=folder)
        self.source = config.backend
        self.device = choose_device(config.device)
        self.dtype = choose_dtype(config.precision, self.device)
        self._config = config
        model: Any = (
            files.load(Sam3LiteTextModel, "sam3_lite_text_video")
            if light
            else files.load(Sam3Model, "sam3_video")
        )
        self._tokenizer = files.tokenizer()
        self._normalisation = files.normalisation(HALF, HALF)
        with memory_guard("moving SAM 3 to its device"):
            self._model = model.to(self.device, self.dtype)
        if config.compile:
            self._model.vision_encoder = torch.compile(self._model.vision_encoder)
        self._texts: dict[str, tuple[Tensor, Tensor]] = {}

    def segment(
        self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None
    ) -> Detections:
        """Find the instances of each label; see `Segmenter.segment`."""
        channels = checked_channels(color, labels, ooi)
        height, width = color.shape[:2]
        size = heatmap_size((height, width), self._config.longest_side_px)
        with torch.inference_mode(), memory_guard(f"SAM 3 on an image of {width}x{height}"):
            found = self._find(color, channels, size)
            kept = distinct_boxes(found.boxes, found.scores)
            extent = found.boxes.new_tensor([width, height, width, height])
            boxes = (found.boxes[kept] * extent).cpu().numpy()
            scores = found.scores[kept].cpu().numpy()
            names = [channels[k] for k in found.channels[kept].tolist()]
            masks = mask_arrays(found.masks[kept])
        return make_detections(
            boxes,
            scores,
            names,
            source=self.source,
            labels=channels,
            ooi=ooi,
            image_size=(height, width),
            masks=masks,
        )

    def _find(
        self, color: NDArray[np.uint8], channels: tuple[str, ...], size: tuple[int, int]
    ) -> _Found:
        """Decode the image for each label, in alphabetical order so that batches repeat."""
        seen = self._model.get_vision_features(self._prepare(color))
        self._read([name for name in channels if name not in self._texts])
        order = sorted(range(len(channels)), key=lambda k: channels[k])
        at_once = LABELS_AT_ONCE.get(self.device.type, FEW_LABELS)
        parts = [
            self._decode(seen, [channels[k] for k in some], some, size)
            for some in (order[k : k + at_once] for k in range(0, len(order), at_once))
        ]
        return _Found(
            boxes=torch.cat([part.boxes for part in parts]),
            scores=torch.cat([part.scores for part in parts]),
            channels=torch.cat([part.channels for part in parts]),
            masks=torch.cat([part.masks for part in parts]),
        )

    def _decode(
        self, seen: Any, names: list[str], numbers: list[int], size: tuple[int, int]
    ) -> _Found:
        features = torch.stack([self._texts[name][0] for name in names])
        mask = torch.stack([self._texts[name][1] for name in names])
        repeated = type(seen)(
            fpn_hidden_states=_repeated(seen.fpn_hidden_states, len(names)),
            fpn_position_encoding=_repeated(seen.fpn_position_encoding, len(names)),
        )
        given = self._model(
            vision_embeds=repeated,
            text_embeds=BaseModelOutputWithPooling(pooler_output=features),
            attention_mask=mask,
        )
        # The presence of the label in the image has a separate score.
        present = given.presence_logits.float().sigmoid()
        scores = given.pred_logits.float().sigmoid() * present
        # NaN is kept, so that it raises an error later.
        rows, queries = torch.nonzero(~(scores <= LEAST_SCORE), as_tuple=True)
        best = scores[rows, queries].argsort(descending=True, stable=True)[:MAX_INSTANCES]
        rows, queries = rows[best], queries[best]
        logits = given.pred_masks[rows, queries].float()
        return _Found(
            boxes=given.pred_boxes[rows, queries].float(),
            scores=scores[rows, queries],
            channels=torch.tensor(numbers, device=rows.device)[rows],
            masks=resized_masks(logits.sigmoid(), size) > 0.5,
        )

    def _read(self, names: list[str]) -> None:
        """Encode the words of new labels."""
        if not names:
            return
        words = [words_of(name) for name in names]
        tokens = self._tokenizer(
            words, padding="max_length", truncation=True, max_length=TOKENS, return_tensors="pt"
        ).to(self.device)
        mask = tokens["attention_mask"]
        given = self._model.get_text_features(input_ids=tokens["input_ids"], attention_mask=mask)
        self._texts.update(
            {
                name: (features, one)
                for name, features, one in zip(names, given.pooler_output, mask, strict=True)
            }
        )

    def _prepare(self, color: NDArray[np.uint8]) -> Tensor:
        """Stretch the image to the square of the model's training."""
        side = self._model.config.vision_config.image_size
        image = as_tensor(color, self.device)
        square = resized(image, (side, side))
        return normalised(square, *self._normalisation).to(self.dtype)


def _repeated(levels: tuple[Tensor, ...], count: int) -> tuple[Tensor, ...]:
    return tuple(level.expand(count, -1, -1, -1) for level in levels)
