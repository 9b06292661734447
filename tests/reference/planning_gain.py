"""Gain, eq. (3), and object framing of a viewpoint, one orientation at a time."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ippon.guidance.levels import Level
from ippon.mapping.arrays import NOT_MAPPED, MapArrays
from ippon.planning.visibility.panorama import Panorama
from ippon.planning.visibility.view_table import Orientations, ViewTable
from ippon.planning.visibility.viewpoint_gain import ViewSums
from tests.reference.planning_view import pool_of, window


def imagined_level(counts: Sequence[int], minimum: int) -> int:
    """Return the level of eq. (3): certain, far or near if there are enough voxels of it."""
    order = (Level.CERTAIN, Level.FAR, Level.NEAR)
    return next((level for level in order if counts[level] >= minimum), Level.AVERAGE)


def gains(
    sums: ViewSums,
    probabilities: Sequence[float],
    minimum: int,
    far_evidence_nat: NDArray[np.float32],
    cued: NDArray[np.bool_],
    weights: NDArray[np.float32],
    painted: NDArray[np.float32],
) -> tuple[NDArray[np.float64], list[int], float]:
    """Return (A, B) gains, the level of each heading, and the potential."""
    result = np.zeros(sums.known.shape)
    levels, potential = [], 0.0
    for a, row in enumerate(result):
        level = Level.CERTAIN if cued[a] else imagined_level(sums.levels[a].tolist(), minimum)
        levels.append(int(level))
        p_img = probabilities[level] * math.exp(far_evidence_nat[a])
        for b in range(len(row)):
            row[b] = weights[a] * (sums.known[a, b] + p_img * sums.unknown[a, b])
            average = sums.known[a, b] + probabilities[Level.AVERAGE] * sums.unknown[a, b]
            potential = max(potential, painted[a] * average)
    return result, levels, potential


def framing_scores(
    panorama: Panorama, orientations: Orientations, table: ViewTable, centre_weight: float
) -> NDArray[np.float64]:
    """Return (A, B) object voxels in each image, less their distance from its centre."""
    cells = [
        (
            (column + 0.5) * table.bin_rad,
            table.pitch_low + (row + 0.5) * table.bin_rad,
            float(panorama.framed[row, column]),
        )
        for row, column in np.argwhere(panorama.framed > 0)
    ]
    total = sum(count for _, _, count in cells)
    yaw = math.atan2(
        sum(count * math.sin(yaw) for yaw, _, count in cells),
        sum(count * math.cos(yaw) for yaw, _, count in cells),
    )
    pitch = sum(count * pitch for _, pitch, count in cells) / total
    scores = np.zeros((len(orientations.yaws), len(orientations.tilts)))
    for a, b in np.ndindex(scores.shape):
        turned = math.remainder(orientations.yaws[a] - yaw, 2.0 * math.pi)
        off = math.hypot(turned, orientations.tilts[b] - pitch)
        shown = window(panorama.framed, orientations, a, b)
        scores[a, b] = shown - centre_weight * total * off
    return scores


def recount(
    arrays: MapArrays, table: ViewTable, camera: tuple[int, int, int], labelled: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Count the levels of some of a table's voxels by heading column, (Y, 4)."""
    counts = np.zeros((table.yaw_bins, 4), dtype=np.int32)
    for n in labelled:
        direction = int(np.searchsorted(table.start, n, side="right")) - 1
        row, column = pool_of(arrays, *(np.array(camera) + table.offset[n]))
        if row >= 0:
            level = arrays.level[arrays.slab[row], column]
            if level != NOT_MAPPED:
                counts[direction % table.yaw_bins, level] += 1
    return counts
