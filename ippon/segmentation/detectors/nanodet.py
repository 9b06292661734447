"""NanoDet-Plus from ncnn files (github.com/RangiLyu/nanodet)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ippon.observation import Detections
from ippon.segmentation.detectors.vocabulary import Vocabulary
from ippon.segmentation.errors import CheckpointError, MissingPackageError, SegmentationError
from ippon.segmentation.instances import make_detections
from ippon.segmentation.segmenter import checked_channels

SIDE_PX: Final = 416
STRIDES: Final = (8, 16, 32, 64)
BINS: Final = 8
"""Of the distribution over the distance to each side, in strides."""
MEAN_BGR: Final = np.array([103.53, 116.28, 123.675], np.float32)
SCALE_BGR: Final = np.array([0.017429, 0.017507, 0.017125], np.float32)
LEAST_SCORE: Final = 0.05
"""Lower scores are not kept: the observation model decides what the others are worth."""
SAME_OVERLAP: Final = 0.6
"""Boxes of a class that share so much of their union are one thing."""
_MAGIC: Final = b"7767517"
_MOST_OF_A_CLASS: Final = 100


class NanoDetSegmenter:
    """Finds the instances of COCO's categories.

    Args:
        model: The `.param` file; its `.bin` lies beside it.
        vocabulary: Names of the classes.
        threads: Threads that the network may take.

    Raises:
        MissingPackageError: ncnn is not installed.
        CheckpointError: The files are no such network.
    """

    def __init__(
        self, model: Path, vocabulary: Vocabulary | None = None, *, threads: int = 1
    ) -> None:
        check_ncnn_files(model)
        try:
            import ncnn  # noqa: PLC0415  # The library does without it.
        except ImportError as error:
            raise MissingPackageError(
                "ncnn files need the package ncnn: pip install 'ippon[detector]'"
            ) from error
        self.vocabulary = vocabulary or Vocabulary()
        self.source = "nanodet-plus"
        self._ncnn: Any = ncnn
        self._net: Any = self._ncnn.Net()
        self._net.opt.num_threads = threads
        if self._net.load_param(str(model)) != 0:
            raise CheckpointError(f"{model} cannot be read by ncnn {ncnn.__version__}")
        if self._net.load_model(str(model.with_suffix(".bin"))) != 0:
            raise CheckpointError(f"{model.with_suffix('.bin')} does not belong to {model.name}")
        self._cells = _cells()
        self._output(np.zeros((SIDE_PX, SIDE_PX, 3), np.float32))

    def detect(
        self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None
    ) -> Detections:
        """Find the instances of labels in an image.

        Args:
            color: (H, W, 3) uint8 RGB.
            labels: Labels that are looked for; those that the network cannot tell are left out.
            ooi: Object of interest, or None.

        Raises:
            ValueError: Not an image, or labels that are no vocabulary.
            SegmentationError: The network failed.
        """
        asked = checked_channels(color, labels, ooi)
        class_of = {label: self.vocabulary.class_of(label) for label in asked}
        known = tuple(label for label in asked if class_of[label] is not None)
        height, width = color.shape[:2]
        scale = SIDE_PX / max(height, width)
        out = self._output(_prepared(color, scale))
        names: list[str] = []
        rows: list[int] = []
        columns: list[int] = []
        scores, boxes = out[:, : len(self.vocabulary.names)], self._boxes(out) / scale
        # Two labels of one class are two names of the same thing: each gets the instance.
        for label in known:
            k = class_of[label]
            assert k is not None
            kept = distinct(boxes, scores[:, k])
            names += [label] * len(kept)
            rows += kept
            columns += [k] * len(kept)
        return make_detections(
            boxes[rows].reshape(-1, 4),
            scores[rows, columns].reshape(-1),
            names,
            source=self.source,
            labels=known,
            ooi=ooi if ooi in known else None,
            image_size=(height, width),
        )

    def _output(self, pixels: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (cells, classes + 4 * BINS) float32 for a (SIDE, SIDE, 3) image."""
        # ncnn refers to the array without holding it, until it is copied.
        planes = np.ascontiguousarray(pixels.transpose(2, 0, 1))
        data = self._ncnn.Mat(planes).clone()
        run = self._net.create_extractor()
        if run.input("data", data) != 0:
            raise CheckpointError("the network has no input 'data': it is no NanoDet-Plus")
        status, found = run.extract("output")
        if status != 0:
            raise SegmentationError(f"the network failed (ncnn status {status})")
        out = np.array(found)
        expected = (len(self._cells), len(self.vocabulary.names) + 4 * BINS)
        if out.shape != expected:
            raise CheckpointError(
                f"the network's output is {out.shape}; {len(self.vocabulary.names)} classes at "
                f"{SIDE_PX} px make {expected}: another network, or another list of labels"
            )
        return out

    def _boxes(self, out: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (cells, 4) left, top, right, bottom in pixels of the network's image."""
        bins = out[:, len(self.vocabulary.names) :].reshape(-1, 4, BINS)
        shares = np.exp(bins - bins.max(axis=2, keepdims=True))
        shares /= shares.sum(axis=2, keepdims=True)
        away = (shares @ np.arange(BINS, dtype=np.float32)) * self._cells[:, 2:]
        at = self._cells[:, :2]
        return np.concatenate([at - away[:, :2], at + away[:, 2:]], axis=1)


def check_ncnn_files(model: Path) -> None:
    """Refuse files that ncnn would crash on.

    Raises:
        CheckpointError: With what the file is, and what would do.
    """
    weights = model.with_suffix(".bin")
    if model.suffix != ".param":
        raise CheckpointError(
            f"{model} is no ncnn .param file; a detector is FILE.param with FILE.bin beside it"
        )
    for path in (model, weights):
        if not path.is_file():
            raise CheckpointError(f"{path} is missing; ncnn needs {model.name} and {weights.name}")
    text = model.read_bytes()
    if not text.startswith(_MAGIC):
        raise CheckpointError(f"{model} does not begin with {_MAGIC.decode()}: no ncnn .param file")
    words = {word for line in text.split(b"\n")[2:] for word in line.split()[:12]}
    if b"data" not in words or b"output" not in words:
        raise CheckpointError(
            f"{model} has no blobs named data and output: it is no NanoDet-Plus, the one ncnn "
            "architecture that is known"
        )
    if weights.stat().st_size < 100_000:
        raise CheckpointError(f"{weights} has {weights.stat().st_size} bytes: it is cut off")


def distinct(boxes: NDArray[np.float32], scores: NDArray[np.float32]) -> list[int]:
    """Choose boxes, best first, leaving out those that a better one covers.

    Args:
        boxes: (N, 4) left, top, right, bottom.
        scores: (N,).

    Returns:
        Rows.
    """
    order = np.flatnonzero(scores >= LEAST_SCORE)
    order = order[np.argsort(-scores[order], kind="stable")]
    kept: list[int] = []
    while len(order) and len(kept) < _MOST_OF_A_CLASS:
        best = int(order[0])
        kept.append(best)
        low = np.maximum(boxes[best, :2], boxes[order, :2])
        high = np.minimum(boxes[best, 2:], boxes[order, 2:])
        shared = (high - low).clip(min=0.0).prod(axis=1)
        areas = (boxes[order, 2:] - boxes[order, :2]).prod(axis=1)
        union = areas + (boxes[best, 2:] - boxes[best, :2]).prod() - shared
        order = order[shared < SAME_OVERLAP * np.maximum(union, 1e-9)]
        order = order[order != best]
    return kept


def _cells() -> NDArray[np.float32]:
    """Return (cells, 3) place in pixels and stride of each cell."""
    parts: list[NDArray[np.float32]] = []
    for stride in STRIDES:
        n = -(-SIDE_PX // stride)
        v, u = np.mgrid[:n, :n]
        columns = (u.ravel() * stride, v.ravel() * stride, np.full(n * n, stride))
        parts.append(np.stack(columns, axis=1).astype(np.float32))
    return np.concatenate(parts)


def _prepared(color: NDArray[np.uint8], scale: float) -> NDArray[np.float32]:
    """Return (SIDE, SIDE, 3) float32 BGR, the longer side scaled, the rest 0."""
    height, width = (max(1, round(s * scale)) for s in color.shape[:2])
    small = Image.fromarray(color).resize((width, height), Image.Resampling.BILINEAR)
    out = np.zeros((SIDE_PX, SIDE_PX, 3), np.float32)
    out[:height, :width] = (np.asarray(small)[..., ::-1] - MEAN_BGR) * SCALE_BGR
    return out
