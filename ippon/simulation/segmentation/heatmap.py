"""Heatmaps from instance images: sampling, neighbours, blending of probability vectors."""

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit

Float32Array = NDArray[np.float32]
Int32Array = NDArray[np.int32]
UInt8Array = NDArray[np.uint8]

_TAPS = 5
_CENTRE_WEIGHT = 0.5
_SHARES = 255
"""Steps between bad and good, as fine as the quantised probabilities."""
_REPAID = 4
"""Rounding error in units of 1/255 that is added to the largest channel."""


def sample_instances(
    instance: Int32Array, size: tuple[int, int], edge_px: float, warp: Float32Array
) -> Int32Array:
    """Read an instance image at the sample points of each pixel of a smaller image.

    Args:
        instance: (H, W) int32.
        size: (h, w) of the smaller image.
        edge_px: Distance of the outer points from the pixel's centre, in pixels of the result.
        warp: (gh, gw, 2) float32, interpolated over the image: displacement of all five points down
            and right, in pixels of the result.

    Returns:
        (h, w, 5) int32: at the centre, left, right, above, below.
    """
    out = np.empty((*size, _TAPS), dtype=np.int32)
    _sample_kernel(instance, edge_px, warp, out)
    return out


@njit(cache=True, nogil=True)
def _sample_kernel(instance: Int32Array, edge: float, warp: Float32Array, out: Int32Array) -> None:
    height, width = instance.shape
    h, w = out.shape[:2]
    sy, sx = height / h, width / w
    for i in range(h):
        for j in range(w):
            y = (i + 0.5 + stretched_kernel(warp[..., 0], i, j, h, w)) * sy
            x = (j + 0.5 + stretched_kernel(warp[..., 1], i, j, h, w)) * sx
            row, column = min(max(int(y), 0), height - 1), min(max(int(x), 0), width - 1)
            out[i, j, 0] = instance[row, column]
            out[i, j, 1] = instance[row, min(max(int(x - edge * sx), 0), width - 1)]
            out[i, j, 2] = instance[row, min(max(int(x + edge * sx), 0), width - 1)]
            out[i, j, 3] = instance[min(max(int(y - edge * sy), 0), height - 1), column]
            out[i, j, 4] = instance[min(max(int(y + edge * sy), 0), height - 1), column]


@njit(cache=True, nogil=True, inline="always")
def stretched_kernel(grid: Float32Array, i: int, j: int, h: int, w: int) -> float:
    """Interpolate a (gh, gw) grid over an (h, w) image at pixel (i, j), bilinearly."""
    y = i * (grid.shape[0] - 1) / h
    x = j * (grid.shape[1] - 1) / w
    y0, x0 = int(y), int(x)
    fy, fx = y - y0, x - x0
    top = (1.0 - fx) * grid[y0, x0] + fx * grid[y0, x0 + 1]
    bottom = (1.0 - fx) * grid[y0 + 1, x0] + fx * grid[y0 + 1, x0 + 1]
    return (1.0 - fy) * top + fy * bottom


def part_of_grid(
    grid: NDArray[np.float64], window: tuple[float, float, float, float]
) -> NDArray[np.float64]:
    """Return the part of an interpolated grid that a crop of the image covers.

    Args:
        grid: (gh, gw), interpolated over the image.
        window: Top, left, height and width of the crop as shares of the image.

    Returns:
        (gh, gw) for the crop; the grid itself for the whole image.
    """
    if window == (0.0, 0.0, 1.0, 1.0):
        return grid
    for axis, (start, extent) in enumerate(((window[0], window[2]), (window[1], window[3]))):
        n = grid.shape[axis]
        at = (start + extent * np.linspace(0.0, 1.0, n)) * (n - 1)
        low = np.minimum(at.astype(np.int64), n - 2)
        part = np.expand_dims(at - low, 1 - axis)
        grid = (1.0 - part) * grid.take(low, axis) + part * grid.take(low + 1, axis)
    return grid


def neighbours(labels: Int32Array, count: int) -> NDArray[np.int64]:
    """Return (count,) the most frequent neighbour of each label; itself without neighbours.

    Args:
        labels: (h, w) int32 in [0, count).
        count: Number of labels.
    """
    borders = np.zeros((count, count), dtype=np.int32)
    _border_kernel(labels, borders)
    most = borders.argmax(axis=1)
    return np.where(borders.max(axis=1, initial=0) > 0, most, np.arange(count))


@njit(cache=True, nogil=True)
def _border_kernel(labels: Int32Array, borders: Int32Array) -> None:
    h, w = labels.shape
    for i in range(h):
        for j in range(w):
            a = labels[i, j]
            if j + 1 < w and labels[i, j + 1] != a:
                b = labels[i, j + 1]
                borders[a, b] += 1
                borders[b, a] += 1
            if i + 1 < h and labels[i + 1, j] != a:
                b = labels[i + 1, j]
                borders[a, b] += 1
                borders[b, a] += 1


def blend(
    samples: Int32Array, good: Float32Array, bad: Float32Array, field: Float32Array
) -> UInt8Array:
    """Mix the probability vectors of the instances in each pixel.

    Args:
        samples: (h, w, 5) int32 rows of `good` and `bad`, as from `sample_instances`.
        good: (K, C) float32 vectors where the image is good, each summing to 1.
        bad: (K, C) float32 vectors where it is bad.
        field: (gh, gw) float32 of about unit variance, interpolated over the image; above 1 means
            good, below -1 bad, in between a mixture in steps of 1/255.

    Returns:
        (h, w, C) uint8 in units of 1/255; the channels of each pixel sum to 255.
    """
    rows, channels = good.shape
    out = np.empty((*samples.shape[:2], channels), dtype=np.uint8)
    _blend_kernel(
        samples,
        good,
        bad,
        field,
        (good + bad).argmax(axis=1),
        np.empty(channels, dtype=np.float32),
        np.empty((rows, _SHARES + 1, channels), dtype=np.uint8),
        np.zeros((rows, _SHARES + 1), dtype=np.bool_),
        out,
    )
    return out


@njit(cache=True, nogil=True)
def _blend_kernel(
    samples: Int32Array,
    good: Float32Array,
    bad: Float32Array,
    field: Float32Array,
    largest: NDArray[np.int64],
    mixed: Float32Array,
    known: UInt8Array,
    is_known: NDArray[np.bool_],
    out: UInt8Array,
) -> None:
    h, w, channels = out.shape
    for i in range(h):
        for j in range(w):
            share = 0.5 + 0.5 * stretched_kernel(field, i, j, h, w)
            level = int(min(max(share, 0.0), 1.0) * _SHARES + 0.5)
            k = samples[i, j, 0]
            uniform = True
            for t in range(1, _TAPS):
                uniform = uniform and samples[i, j, t] == k
            # Most pixels show one instance, many at the same share: computed once.
            if uniform and is_known[k, level]:
                for c in range(channels):
                    out[i, j, c] = known[k, level, c]
                continue
            mixed[:] = 0.0
            centre = 1.0 if uniform else _CENTRE_WEIGHT
            for t in range(1 if uniform else _TAPS):
                weight = centre if t == 0 else (1.0 - centre) / (_TAPS - 1)
                a = np.float32(255.0 * weight * level / _SHARES)
                b = np.float32(255.0 * weight * (_SHARES - level) / _SHARES)
                row = samples[i, j, t]
                for c in range(channels):
                    mixed[c] += a * good[row, c] + b * bad[row, c]
            _round_kernel(mixed, int(largest[k]), out[i, j])
            if uniform:
                for c in range(channels):
                    known[k, level, c] = out[i, j, c]
                is_known[k, level] = True


@njit(cache=True, nogil=True)
def _round_kernel(mixed: Float32Array, large: int, out: UInt8Array) -> None:
    """Round with a constant sum: small errors go to the largest channel, large to neighbours."""
    total = np.int32(0)
    for c in range(mixed.shape[0]):
        value = np.int32(mixed[c] + np.float32(0.5))
        out[c] = np.uint8(value)
        total += value
    missing = np.int32(255) - total
    if abs(missing) <= _REPAID and out[large] >= 8 * _REPAID:
        out[large] = np.uint8(out[large] + missing)
    else:
        _round_in_turn(mixed, out)


@njit(cache=True, nogil=True)
def _round_in_turn(mixed: Float32Array, out: UInt8Array) -> None:
    """Round with a constant sum: the error of each channel goes to the next."""
    carry = np.float32(0.5)
    for c in range(mixed.shape[0]):
        carry += mixed[c]
        value = np.uint8(carry)
        carry -= np.float32(value)
        out[c] = value


def compact_samples(samples: Int32Array) -> tuple[Int32Array, Int32Array]:
    """Return the sorted distinct values, all at least -1, and the samples as rows of them."""
    present = np.zeros(int(samples.max(initial=-1)) + 2, dtype=np.int32)
    _mark_kernel(samples.reshape(-1), present)
    rows = np.cumsum(present, dtype=np.int32) - np.int32(1)
    compact = np.empty(samples.shape, dtype=np.int32)
    _relabel_kernel(samples.reshape(-1), rows, compact.reshape(-1))
    return np.flatnonzero(present).astype(np.int32) - np.int32(1), compact


@njit(cache=True, nogil=True)
def _mark_kernel(samples: Int32Array, present: Int32Array) -> None:
    for n in range(samples.shape[0]):
        present[samples[n] + 1] = 1


@njit(cache=True, nogil=True)
def _relabel_kernel(samples: Int32Array, rows: Int32Array, compact: Int32Array) -> None:
    for n in range(samples.shape[0]):
        compact[n] = rows[samples[n] + 1]


def sigmoid(logit: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the logistic function of a logit."""
    return 1.0 / (1.0 + np.exp(-logit))
