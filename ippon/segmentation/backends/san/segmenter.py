"""SAN as a segmenter, with cached text embeddings."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from ippon.observation import Heatmap
from ippon.segmentation.backends.san.architecture import SIZE_MULTIPLE_PX
from ippon.segmentation.backends.san.network import SanNetwork, normalised
from ippon.segmentation.backends.san.tokenizer import ClipTokenizer
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.device import choose_device, choose_dtype, memory_guard
from ippon.segmentation.label_probabilities import as_tensor, probabilities_of, resized
from ippon.segmentation.prompts import VILD_TEMPLATES, words_of
from ippon.segmentation.segmenter import checked_channels, heatmap_of, heatmap_size

KEPT_LABELS: Final = 4096
"""Number of cached label embeddings."""


class SanSegmenter:
    """Segments images with a SAN; implements `Segmenter`."""

    def __init__(
        self,
        network: SanNetwork,
        tokenizer: ClipTokenizer,
        config: SegmentationConfig,
        templates: Sequence[str] = VILD_TEMPLATES,
    ) -> None:
        """Move the network to its device.

        Args:
            network: With its weights; it is moved and cast, not copied.
            tokenizer: Of the text tower.
            config: Device, precision, sizes.
            templates: Sentences whose embeddings are averaged, each with one `{}`.
        """
        self.device = choose_device(config.device)
        self.dtype = choose_dtype(config.precision, self.device)
        self.embedded = 0
        """Number of labels embedded so far; each is embedded once."""
        self._config = config
        self._tokenizer = tokenizer
        self._templates = tuple(templates)
        with memory_guard("moving SAN to its device"):
            network.to(self.device, self.dtype)
            # Each label is embedded once, so full precision is affordable.
            self._text = network.ov_classifier.float()
        self._run = torch.compile(network) if config.compile else network
        self._embeddings: dict[str, Tensor] = {}
        self._weights: tuple[tuple[str, ...], Tensor] | None = None

    def segment(self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None) -> Heatmap:
        """Return label probabilities at each pixel; see `Segmenter.segment`."""
        channels = checked_channels(color, labels, ooi)
        height, width = color.shape[:2]
        size = heatmap_size((height, width), self._config.longest_side_px)
        with torch.inference_mode(), memory_guard(f"SAN on an image of {width}x{height}"):
            weights = self._class_weights(channels)
            image, seen = self._prepare(color)
            class_logits, mask_logits = self._run(image, weights)
            probabilities = label_probabilities(class_logits[0], mask_logits[0], seen, size)
            return heatmap_of(probabilities.cpu().numpy(), labels, ooi, "san")

    def _class_weights(self, channels: tuple[str, ...]) -> Tensor:
        if self._weights is None or self._weights[0] != channels:
            new = [name for name in channels if name not in self._embeddings]
            if len(self._embeddings) + len(new) > KEPT_LABELS:
                self._embeddings.clear()
                new = list(channels)
            if new:
                self._embeddings.update(zip(new, self._embed(new), strict=True))
                self.embedded += len(new)
            rows = torch.stack([self._embeddings[name] for name in channels])
            self._weights = (channels, self._text.weights(rows).to(self.dtype))
        return self._weights[1]

    def _embed(self, names: Sequence[str]) -> Tensor:
        """Return (N, E): the mean over the templates, of unit length."""
        total: Tensor | None = None
        for template in self._templates:
            tokens = self._tokenizer.encode([template.format(words_of(name)) for name in names])
            embedded = self._text.embed(torch.from_numpy(tokens).to(self.device))
            total = embedded if total is None else total + embedded
        assert total is not None
        return functional.normalize(total, dim=-1)

    def _prepare(self, color: NDArray[np.uint8]) -> tuple[Tensor, tuple[float, float]]:
        """Resize, normalise and pad; return also the share of each side that is image."""
        image = as_tensor(color, self.device)
        scale = self._config.short_side_px / min(image.shape[2:])
        h, w = (max(1, round(side * scale)) for side in image.shape[2:])
        bottom, right = -h % SIZE_MULTIPLE_PX, -w % SIZE_MULTIPLE_PX
        padded = functional.pad(normalised(resized(image, (h, w))), (0, right, 0, bottom))
        return padded.to(self.dtype), (h / (h + bottom), w / (w + right))


def label_probabilities(
    class_logits: Tensor, mask_logits: Tensor, seen: tuple[float, float], size: tuple[int, int]
) -> Tensor:
    """Return probabilities per pixel from masks and their classes.

    SAN sums, over the masks, the probability of the pixel in the mask times that of the label.

    Args:
        class_logits: (Q, C + 1), the last column 'none of these'.
        mask_logits: (Q, h', w'), of the padded image.
        seen: Shares of height and width that are not padding.
        size: (h, w) to return.

    Returns:
        (C, h, w) float32, summing to 1 over the labels.
    """
    h, w = size
    padded = (max(h, round(h / seen[0])), max(w, round(w / seen[1])))
    masks = functional.interpolate(
        mask_logits[None].float(), size=padded, mode="bilinear", align_corners=False
    )[0, :, :h, :w]
    fits = class_logits.float().softmax(dim=-1)[:, :-1]
    return probabilities_of(torch.einsum("qc,qhw->chw", fits, masks.sigmoid()))
