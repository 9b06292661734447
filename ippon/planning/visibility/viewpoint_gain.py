"""Gain G(n), eq. (3), and orientation of a viewpoint, from the sums of its panorama."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import NOT_MAPPED, MapArrays
from ippon.planning.visibility.panorama import Panorama
from ippon.planning.visibility.view_table import Orientations, ViewTable
from ippon.planning.voxel_lookup import block_row, voxel_column


class ViewSums(NamedTuple):
    """A panorama summed over the image that each candidate orientation shows."""

    known: NDArray[np.float32]
    """(A, B) sum of p(v in O), by heading and tilt."""
    unknown: NDArray[np.float32]
    """(A, B) sum of p_occ of voxels outside V_O."""
    ooi: NDArray[np.float32]
    """(A, B) object voxels within reach, and those just beyond."""
    levels: NDArray[np.int32]
    """(A, 4) nearby labelled voxels by level, at any tilt."""


class ViewChoice(NamedTuple):
    """The orientation of highest gain, and the gain of every heading."""

    gain: float
    """G(n), eq. (3), at that orientation."""
    heading: int
    tilt: int
    level: int
    """Level that p_img(n) was taken from at that orientation."""
    potential: float
    """Highest gain of any orientation if p_img were that of the average level, by the painted
    factors alone."""
    by_heading: NDArray[np.float32]
    """(A,) gain of each heading at its best tilt."""


def sum_views(panorama: Panorama, orientations: Orientations, half_fov_columns: int) -> ViewSums:
    """Sum a panorama over every candidate image.

    Args:
        panorama: Panorama of the viewpoint.
        orientations: Candidates.
        half_fov_columns: Half the camera's horizontal field of view in raster columns.
    """
    size = (len(orientations.yaws), len(orientations.tilts))
    sums = ViewSums(
        known=np.zeros(size, dtype=np.float32),
        unknown=np.zeros(size, dtype=np.float32),
        ooi=np.zeros(size, dtype=np.float32),
        levels=np.zeros((0, 4), dtype=np.int32),
    )
    _window_kernel(panorama.known, orientations.half_width, orientations.stride, sums.known)
    _window_kernel(panorama.unknown, orientations.half_width, orientations.stride, sums.unknown)
    if panorama.ooi.any():
        _window_kernel(panorama.framed, orientations.half_width, orientations.stride, sums.ooi)
    return sums._replace(levels=sum_sectors(panorama.levels, orientations, half_fov_columns))


def sum_sectors(
    levels: NDArray[np.int32], orientations: Orientations, half_fov_columns: int
) -> NDArray[np.int32]:
    """Sum (Y, 4) counts by raster column over the view of each candidate heading: (A, 4)."""
    out = np.zeros((len(orientations.yaws), 4), dtype=np.int32)
    _sector_kernel(levels, half_fov_columns, orientations.stride, out)
    return out


@njit(allocates=True, cache=True, nogil=True)
def _window_kernel(image, half_width, stride, out):
    rows, columns = image.shape
    prefix = np.zeros(2 * columns + 1, dtype=np.float64)
    for p in range(rows):
        for y in range(2 * columns):
            prefix[y + 1] = prefix[y] + image[p, y % columns]
        for b in range(half_width.shape[0]):
            half = half_width[b, p]
            if half < 0:
                continue
            half = min(half, columns // 2 - 1)
            for a in range(out.shape[0]):
                first = a * stride - half
                if first < 0:
                    first += columns
                out[a, b] += prefix[first + 2 * half + 1] - prefix[first]


@njit(cache=True, nogil=True)
def _sector_kernel(levels, half, stride, out):
    columns = levels.shape[0]
    for a in range(out.shape[0]):
        for d in range(-half, half + 1):
            y = (a * stride + d) % columns
            for level in range(4):
                out[a, level] += levels[y, level]


def recount_levels(
    arrays: MapArrays,
    table: ViewTable,
    camera_voxel: tuple[int, int, int],
    labelled: NDArray[np.int32],
) -> NDArray[np.int32]:
    """Count the present levels of voxels that an earlier panorama saw; casts no ray.

    Args:
        arrays: The map, with the present levels.
        table: Directions and offsets of the panorama.
        camera_voxel: Voxel that held the camera.
        labelled: (M,) rows of the table's offsets in rising order, from `Panorama.labelled`.

    Returns:
        (Y, 4) int32 counts by heading column and level.
    """
    out = np.zeros((table.yaw_bins, 4), dtype=np.int32)
    _recount_kernel(arrays, table, np.array(camera_voxel, dtype=np.int64), labelled, out)
    return out


@njit(cache=True, nogil=True)
def _recount_kernel(arrays, table, camera, labelled, out):
    direction = 0
    for n in labelled:
        while table.start[direction + 1] <= n:
            direction += 1
        i = camera[0] + table.offset[n, 0]
        j = camera[1] + table.offset[n, 1]
        k = camera[2] + table.offset[n, 2]
        row = block_row(arrays, i, j, k)
        if row < 0:
            continue
        level = arrays.level[arrays.slab[row], voxel_column(i, j, k)]
        if level != NOT_MAPPED:
            out[direction % table.yaw_bins, level] += 1


@njit(cache=True, nogil=True)
def imagined_level(counts: NDArray[np.int32], minimum: int) -> int:
    """Return the highest-ranking non-empty level (Sec. Semantic Guidance).

    The order is certain, far, near, average; a level counts as empty below `minimum` voxels.
    """
    if counts[3] >= minimum:
        return 3
    if counts[0] >= minimum:
        return 0
    if counts[2] >= minimum:
        return 2
    return 1


@njit(cache=True, nogil=True)
def with_evidence(p, nat):
    """Return p_img times the likelihood ratio of the far evidence; it may exceed 1.

    This is Bayes' rule for a small prior: the probability that the object is at this one place of
    the home is small even where p_img is large. An update of the odds of p_img would be bounded by
    a factor of 1 / p_img, although the images say more (docs/decisions.md).
    """
    return p if nat == 0.0 else p * np.exp(nat)


def choose_view(
    sums: ViewSums,
    probabilities: NDArray[np.float32],
    min_level_voxels: int,
    far_evidence_nat: NDArray[np.float32],
    cued: NDArray[np.bool_],
    weights: NDArray[np.float32],
    painted: NDArray[np.float32],
) -> ViewChoice:
    """Find the orientation of highest gain, eq. (3).

    Args:
        sums: Sums of the viewpoint's panorama.
        probabilities: (4,) p_img of each level.
        min_level_voxels: Voxels below which a level counts as empty.
        far_evidence_nat: (A,) nat, log-likelihood ratio of the object in each heading's view.
        cued: (A,) headings that look at far evidence of a label that is certainly near the object.
        weights: (A,) factor on the gain of each heading.
        painted: (A,) factor on its potential: of regions that the operator painted.
    """
    by_heading = np.empty(sums.known.shape[0], dtype=np.float32)
    rules = (probabilities, min_level_voxels)
    gain, heading, tilt, level, potential = _choose_kernel(
        sums.known, sums.unknown, sums.levels, rules, far_evidence_nat, cued,
        (weights, painted), by_heading,
    )  # fmt: skip
    return ViewChoice(gain, heading, tilt, level, potential, by_heading)


@njit(cache=True, nogil=True)
def _choose_kernel(known, unknown, levels, rules, far_evidence_nat, cued, factors, by_heading):
    probabilities, minimum = rules
    weights, painted = factors
    best, best_a, best_b, best_level = -1.0, 0, 0, 1
    potential = 0.0
    for a in range(known.shape[0]):
        level = 3 if cued[a] else imagined_level(levels[a], minimum)
        p_img = with_evidence(probabilities[level], far_evidence_nat[a])
        top = -1.0
        for b in range(known.shape[1]):
            gain = weights[a] * (known[a, b] + p_img * unknown[a, b])
            top = max(top, gain)
            usual = known[a, b] + probabilities[1] * unknown[a, b]
            potential = max(potential, painted[a] * usual)
            if gain > best:
                best, best_a, best_b, best_level = gain, a, b, level
        by_heading[a] = top
    return best, best_a, best_b, best_level, potential


def frame_object(
    sums: ViewSums,
    panorama: Panorama,
    orientations: Orientations,
    table: ViewTable,
    before: tuple[float, float] | None = None,
    *,
    hold: float,
    centre_weight: float,
) -> tuple[float, float] | None:
    """Find the orientation that shows the most object voxels (object framing).

    Among orientations that show equally many, the one closest to their centre wins. The previous
    framing is kept unless another shows clearly more: otherwise a single voxel near the threshold
    would turn the robot back and forth.

    Args:
        sums: Sums of the viewpoint's panorama.
        panorama: The panorama.
        orientations: Candidates.
        table: Directions of the panorama.
        before: Yaw and tilt of the previous framing, radians; None for none.
        hold: See `ViewConfig.framing_hold`.
        centre_weight: See `ViewConfig.framing_centre_weight`.

    Returns:
        Yaw and tilt in radians; None when no object voxel is within reach.
    """
    if not panorama.ooi.any():
        return None
    framed = panorama.framed
    total = float(framed.sum())
    rows, columns = np.nonzero(framed)
    weight = framed[rows, columns].astype(np.float64)
    yaw = (columns + 0.5) * table.bin_rad
    pitch = float(((table.pitch_low + (rows + 0.5) * table.bin_rad) * weight).sum() / total)
    centre = math.atan2(float((np.sin(yaw) * weight).sum()), float((np.cos(yaw) * weight).sum()))
    off_yaw = np.abs((orientations.yaws - centre + math.pi) % (2.0 * math.pi) - math.pi)
    off = np.hypot(off_yaw[:, None], (orientations.tilts - pitch)[None, :])
    score = sums.ooi - centre_weight * total * off
    a, b = np.unravel_index(int(np.argmax(score)), score.shape)
    if before is not None:
        kept = (
            int(np.argmin(np.abs(orientations.yaws - before[0]))),
            int(np.argmin(np.abs(orientations.tilts - before[1]))),
        )
        if score[kept] >= score[a, b] - hold * total:
            a, b = kept
    return float(orientations.yaws[a]), float(orientations.tilts[b])
