"""Conversion of instances to heatmaps, by mask or by the depth inside their box."""

from collections.abc import Collection, Iterable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.observation import Detections, Heatmap, Instance, Observation
from ippon.observation_model import LEAST_SCORE, NOT_RECOGNISED, NOTHING_SAID
from ippon.vocabulary import MATTERPORT_40

WELL_SEEN_M: Final = 3.0
"""Range within which a label that was not recognised counts as evidence against it."""
BORDER_SHARE: Final = 0.05
"""Rim of the image, as a share of its side, without such evidence, because objects are cut off
there."""
WINS_FROM: Final = 0.5
"""Share of a larger instance's score from which a smaller one replaces it at a pixel."""
_EXTENT_SHARE: Final = 0.6
"""Depth extent of an object on either side of its centre, as a share of its shorter side."""
_LEAST_EXTENT_M: Final = 0.08
_EDGE_M: Final = 0.15
"""Depth difference of pixels from which they lie on different surfaces."""


def heatmap_of_instances(
    detections: Detections,
    depth: NDArray[np.float32],
    longest_px: int = 160,
    *,
    apart: Collection[str] = (),
) -> Heatmap:
    """Return the score of each label at each pixel.

    A box covers the pixels whose depth is close to that of its middle. Instances are painted from
    the largest to the smallest: an object in front of another takes its pixels, where the covered
    object gets no score.

    Args:
        detections: Instances of an image.
        depth: (H, W) metres, registered to the image; 0 or not finite for no return.
        longest_px: Longer side of the heatmap.
        apart: Labels whose instances do not cover those of each other, so that each of them has the
            score that it has where the others are not asked for.

    Returns:
        A heatmap of kind `scores`.

    Raises:
        ValueError: Depth and image differ in proportions.
    """
    rows, columns = detections.image_size
    # Sizes are whole pixels, so a proportional one differs by less than a pixel per side.
    off = abs(depth.shape[0] * columns - depth.shape[1] * rows)
    if off > max(*depth.shape, rows, columns):
        raise ValueError(
            f"depth of {depth.shape[1]}x{depth.shape[0]} does not fit an image of {columns}x{rows}"
        )
    step = max(1, -(-max(depth.shape) // longest_px))
    depth = np.where(np.isfinite(depth), depth, np.float32(0.0))
    near = depth[step // 2 :: step, step // 2 :: step]
    common = tuple(label for label in detections.labels if label != detections.ooi)
    channels = common if detections.ooi is None else (*common, detections.ooi)
    is_apart = np.array([label in apart for label in channels], np.bool_)
    mixed = _is_mixed(depth, near, step)
    out = np.full((*near.shape, len(channels)), NOTHING_SAID, np.uint8)
    out[_well_seen(near) & ~mixed] = NOT_RECOGNISED
    scale = depth.shape[1] / columns / step
    for one in sorted(detections.instances, key=_area, reverse=True):
        pixels = _pixels(one, near, scale)
        if pixels is None:
            continue
        window, inside = pixels
        inside = inside & ~mixed[window]
        value = max(LEAST_SCORE, round(255.0 * one.score))
        _paint_kernel(inside, value, channels.index(one.label), is_apart, out[window])
    return Heatmap(
        labels=common,
        ooi=detections.ooi,
        probabilities=out,
        kind="scores",
        source=detections.source,
    )


def as_heatmap(
    seen: Observation, depth: NDArray[np.float32], *, apart: Collection[str] = ()
) -> Heatmap:
    """Return a heatmap as it is, and that of instances; see `heatmap_of_instances`."""
    return seen if isinstance(seen, Heatmap) else heatmap_of_instances(seen, depth, apart=apart)


def objects_apart(objects: Iterable[str]) -> frozenset[str]:
    """Return the objects that are read each for itself: those that are no label of a map.

    Args:
        objects: Labels that the network gives the requested objects.
    """
    return frozenset(objects) - frozenset(MATTERPORT_40)


@njit(cache=True, nogil=True)
def _paint_kernel(inside, value, mine, is_apart, out):
    """Write `value` to a channel of some pixels, and clear the channels that it outscores."""
    h, w, channels = out.shape
    for i in range(h):
        for j in range(w):
            if not inside[i, j]:
                continue
            before = out[i, j, mine]
            for c in range(channels):
                if is_apart[mine] and is_apart[c]:
                    continue
                if out[i, j, c] >= LEAST_SCORE and WINS_FROM * out[i, j, c] <= value:
                    out[i, j, c] = NOTHING_SAID
            out[i, j, mine] = max(before, value)


def _area(one: Instance) -> float:
    left, top, right, bottom = one.box_px
    return (right - left) * (bottom - top)


def _is_mixed(
    depth: NDArray[np.float32], near: NDArray[np.float32], step: int
) -> NDArray[np.bool_]:
    """Return (h, w) whether a heatmap pixel contains more than one surface."""
    mixed = np.zeros(near.shape, np.bool_)
    h, w = near.shape
    for v in range(step):
        for u in range(step):
            other = depth[v::step, u::step][:h, :w]
            rows, columns = other.shape
            far = (other > 0.0) & (np.abs(other - near[:rows, :columns]) > _EDGE_M)
            mixed[:rows, :columns] |= far
    return mixed


def _well_seen(depth: NDArray[np.float32]) -> NDArray[np.bool_]:
    seen = (depth > 0.0) & (depth <= WELL_SEEN_M)
    margin = max(1, round(BORDER_SHARE * max(depth.shape)))
    inner = np.zeros_like(seen)
    inner[margin:-margin, margin:-margin] = True
    return seen & inner


def _pixels(
    one: Instance, depth: NDArray[np.float32], scale: float
) -> tuple[tuple[slice, slice], NDArray[np.bool_]] | None:
    """Return the window of an instance's box, and which of its pixels belong to it."""
    left, top, right, bottom = (x * scale for x in one.box_px)
    window = (
        slice(max(0, int(np.ceil(top - 0.5))), int(np.floor(bottom - 0.5)) + 1),
        slice(max(0, int(np.ceil(left - 0.5))), int(np.floor(right - 0.5)) + 1),
    )
    box = depth[window]
    if box.size == 0:
        return None
    if one.mask is not None:
        # The pixels of the mask at the middles of those of the heatmap.
        v, u = (
            (2 * np.arange(count) + 1) * of // (2 * count)
            for count, of in zip(depth.shape, one.mask.shape, strict=True)
        )
        return window, one.mask[np.ix_(v[window[0]], u[window[1]])] & (box > 0.0)
    h, w = box.shape
    middle = box[h // 4 : max(h // 4 + 1, h - h // 4), w // 4 : max(w // 4 + 1, w - w // 4)]
    known = middle[middle > 0.0]
    if known.size == 0:
        return None
    at = _median(known)
    # One radian is about the width of the image in pixels, for fields of view of 45 to 75 degrees.
    shorter_m = min(bottom - top, right - left) / depth.shape[1] * at
    extent = max(_LEAST_EXTENT_M, _EXTENT_SHARE * shorter_m)
    return window, (box > 0.0) & (np.abs(box - at) <= extent)


def _median(values: NDArray[np.float32]) -> float:
    """Return what `np.median` does, for few values several times faster."""
    high = values.size // 2
    low = (values.size - 1) // 2
    ordered = np.partition(values, (low, high))
    return 0.5 * (float(ordered[low]) + float(ordered[high]))
