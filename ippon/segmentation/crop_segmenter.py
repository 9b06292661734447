"""A second pass over a crop where the object of interest appears small, or may appear."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ippon.observation import Heatmap
from ippon.segmentation.segmenter import DenseSegmenter


@dataclass(frozen=True, slots=True, kw_only=True)
class CropConfig:
    """Size and conditions of the crop."""

    crop_share: float = 0.5
    """Side of the crop as a share of the image's; smaller detects smaller objects and covers less
    per frame."""
    hint_probability: float = 0.12
    """Probability of the object of interest from which the crop follows it; larger follows fewer
    hints and scans more."""
    large_share: float = 0.02
    """Share of the image from which an object is large enough without a second pass; larger takes
    more crops."""
    sure_probability: float = 0.5
    """Probability from which a pixel counts as the object of interest."""
    margin_share: float = 0.06
    """Unused rim of the crop, as a share of it, because objects cut by the border are misread;
    larger wastes more."""

    def __post_init__(self) -> None:
        """Reject values out of range."""
        if not 0.1 <= self.crop_share < 1.0 or not 0.0 <= self.margin_share < 0.4:
            raise ValueError(
                "crop_share must be in 0.1..1 and margin_share in 0..0.4; got "
                f"{self.crop_share}, {self.margin_share}"
            )


@dataclass(frozen=True, slots=True)
class Window:
    """Part of an image, as shares of its height and width."""

    top: float
    left: float
    height: float
    width: float

    @classmethod
    def of(cls, rows: slice, columns: slice, shape: tuple[int, int]) -> "Window":
        """Return the window of some pixels of an (H, W) image."""
        (height, width), (top, left) = shape, (rows.start, columns.start)
        extent = ((rows.stop - top) / height, (columns.stop - left) / width)
        return cls(top / height, left / width, *extent)

    def pixels(self, shape: tuple[int, int]) -> tuple[slice, slice]:
        """Return rows and columns in an image of (H, W) pixels, at least one of each."""
        return (
            _span(self.top, self.height, shape[0]),
            _span(self.left, self.width, shape[1]),
        )

    def shrunk(self, margin: float) -> "Window":
        """Return the window without its rim, except at the image's border."""
        top, height = _without_rim(self.top, self.height, margin)
        left, width = _without_rim(self.left, self.width, margin)
        return Window(top, left, height, width)


def _span(start: float, extent: float, size: int) -> slice:
    # The length is independent of the position, because networks are compiled for one size.
    length = min(size, max(1, round(extent * size)))
    low = min(size - length, round(start * size))
    return slice(low, low + length)


def _without_rim(start: float, extent: float, margin: float) -> tuple[float, float]:
    low = start + margin * extent if start > 0.0 else 0.0
    end = start + extent
    high = end - margin * extent if end < 1.0 else 1.0
    return low, high - low


class CropSegmenter:
    """Segments the whole image, then a crop, whose heatmap replaces that part.

    The crop is at the highest score of the object of interest while it appears small. Without such
    a score the crops scan the image over a few frames. Each image takes at most two passes; several
    objects of interest take turns.
    """

    def __init__(self, segmenter: DenseSegmenter, config: CropConfig | None = None) -> None:
        self._segmenter = segmenter
        self._config = config or CropConfig()
        self._turn = 0
        self._images = 0

    def segment(self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None) -> Heatmap:
        """Return the heatmap of both passes; see `Segmenter.segment`."""
        return self.segment_tour(color, labels, () if ooi is None else (ooi,))

    def segment_tour(
        self, color: NDArray[np.uint8], labels: Sequence[str], goals: Sequence[str]
    ) -> Heatmap:
        """Return the heatmap of both passes; see `segment_tour`."""
        ooi = goals[0] if goals else None
        whole = self._segmenter.segment(color, labels, ooi)
        window = self._window(whole, goals[self._images % len(goals)]) if goals else None
        self._images += 1
        if window is None:
            return whole
        rows, columns = window.pixels((color.shape[0], color.shape[1]))
        part = self._segmenter.segment(np.ascontiguousarray(color[rows, columns]), labels, ooi)
        exact = Window.of(rows, columns, (color.shape[0], color.shape[1]))
        return paste_heatmap(whole, part, exact, self._config.margin_share)

    def _window(self, whole: Heatmap, goal: str) -> Window | None:
        """Return the window of the second pass for an object of interest; None without one."""
        config = self._config
        channel = whole.channel_of(goal)
        if channel is None:
            return None
        p = whole.probabilities[..., channel]
        if np.mean(p >= 255.0 * config.sure_probability) > config.large_share:
            return None
        if p.max() < 255.0 * config.hint_probability:
            return self._next_tile()
        v, u = np.unravel_index(int(p.argmax()), p.shape)
        top, left = (
            min(max((k + 0.5) / n - 0.5 * config.crop_share, 0.0), 1.0 - config.crop_share)
            for k, n in ((v, p.shape[0]), (u, p.shape[1]))
        )
        return Window(top, left, config.crop_share, config.crop_share)

    def _next_tile(self) -> Window:
        """Return the next tile of an overlapping grid over the image."""
        side = self._config.crop_share
        across = math.ceil((1.0 - side) / side) + 1
        row, column = divmod(self._turn % (across * across), across)
        self._turn += 1
        step = (1.0 - side) / (across - 1)
        return Window(row * step, column * step, side, side)


def paste_heatmap(whole: Heatmap, part: Heatmap, window: Window, margin: float) -> Heatmap:
    """Insert the heatmap of a window into the heatmap of the image.

    Args:
        whole: Heatmap of the image.
        part: Heatmap of the window, with the same labels and a finer scale.
        window: Position of `part`.
        margin: Rim of the window that is not replaced, as a share of its side.

    Returns:
        A heatmap of the size of `whole`; the sums of pixels are unchanged.
    """
    rows, columns = window.shrunk(margin).pixels(
        (whole.probabilities.shape[0], whole.probabilities.shape[1])
    )
    h, w = whole.probabilities.shape[:2]
    height, width = part.probabilities.shape[:2]
    v = _inside(rows, h, (window.top, window.height), height)
    u = _inside(columns, w, (window.left, window.width), width)
    probabilities = whole.probabilities.copy()
    probabilities[rows, columns] = part.probabilities[v[:, None], u]
    return replace(whole, probabilities=probabilities)


def _inside(
    span: slice, size: int, interval: tuple[float, float], part_size: int
) -> NDArray[np.int64]:
    """Return, for the pixels of a span of the whole, the nearest pixels of the part."""
    start, extent = interval
    centres = (np.arange(span.start, span.stop) + 0.5) / size
    return np.clip((centres - start) / extent * part_size, 0, part_size - 1).astype(np.int64)
