"""Arithmetic of the paper's Bayes filter over the common objects and the object of interest.

(Sec. Object Probability Mapping.) With equal priors, p(v | I_1..k) is proportional to
p(v | I_k) p(v | I_1..k-1) over {C_1 .. C_N, O}. The posterior is stored in two parts that are
updated separately: q_j = p(C_j | not O), and L = log p(O) / p(not O), with q before its update on
the right:

    q_j <- q_j h_j / sum_i q_i h_i        L <- L + log h_O - log sum_i q_i h_i

so that p(O) = sigmoid(L), p(C_j) = q_j (1 - p(O)), which is the joint filter, and a new object of
interest resets one number per voxel. Where the object of interest is itself the common label a, the
same holds with h_O = h_a and the sums over the labels other than a.

A label's -log q is stored in steps of 1/24 nat, one byte. L is updated with the image's exact
values. For q, an image's value is rounded up or down depending on the image and the voxel, by a
low-discrepancy sequence (golden ratio) whose mean over any run of images is nearly exact. Repeated
likelihood ratios of a hundredth of a step therefore add up correctly, and the error of one image is
below one step.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.frame import UNDERFOOT_M
from ippon.mapping.arrays import INNER, INNER_OPTIONS
from ippon.mapping.objects.surface_voxels import ENERGY_MAX, STEPS_PER_NAT

LOG_ODDS_MAX: Final = 10.0
"""p(O) stays within 4.5e-5 of 0 and 1, so that it can recover."""
_EVERYWHERE_M: Final = 1e6

_SUMS: Final = njit(
    **INNER_OPTIONS,
    fastmath={"nnan", "ninf", "nsz", "reassoc", "contract"},
)
PLACES: Final = 0
PAPER: Final = 1
MAXIMUM: Final = 2
MODES: Final = {"places": PLACES, "paper": PAPER, "max": MAXIMUM}
NONE: Final = -1


class FusionInput(NamedTuple):
    """A heatmap and the rules for reading it, as kernel arguments."""

    probabilities: NDArray[np.uint8]
    """(h, w, C); (1, 1, 1) when the frame has no heatmap."""
    has_heatmap: bool
    channel: NDArray[np.int64]
    """(N,) channel of each map label, `NONE` for labels that the heatmap lacks."""
    in_order: bool
    """The heatmap's first N channels are the map's labels, in order."""
    ooi_channel: int
    """Channel of the map's OOI, `NONE` when the heatmap was not asked for it."""
    ooi_alias: int
    """Map label that is the OOI itself, `NONE` if the OOI is not a common label."""
    settled: int
    """Labels from this one on were added last, while the map was in use."""
    prior: np.float32
    """See `prior_log_odds`."""
    energy_of: NDArray[np.float32]
    """(256,) -log of a heatmap value in steps of 1 / `STEPS_PER_NAT`."""
    likelihood_of: NDArray[np.float32]
    """(T, 256) likelihood ratio of a heatmap value, by the observation model."""
    table_of: NDArray[np.int64]
    """(N + 1,) row of `likelihood_of` of each map label, and of the OOI."""
    camera_at: tuple[float, float, float]
    """Position of the camera in the world, metres."""
    common_max_m: float
    ooi_max_m: float
    ooi_clear_m: float
    """Depth up to which a miss of the object of interest is evidence; beyond, only a score that is
    evidence for it updates a voxel."""
    mode: int
    """`PLACES`, `PAPER` or `MAXIMUM`."""
    levels: NDArray[np.uint8]
    """(N,) proximity level of each label."""
    level_probability: NDArray[np.float32]
    """(N,) l(O | C_j) of each label."""
    suppressed: NDArray[np.float64]
    """(K, 4) balls in which the OOI was rejected: centre and radius, metres."""
    ooi_bounds: tuple[int, int, int]
    """Voxel layers along z: the first of the floor, which is not the OOI, the first above the floor
    that may be, and the first that is too high to be."""


@njit(cache=True, nogil=True, inline="always")
def may_be_ooi(layer, bounds):
    """Tell whether the OOI may be in a voxel layer, given `FusionInput.ooi_bounds`."""
    low, high, top = bounds
    return layer < top and not low <= layer < high


def ooi_bounds(
    lowest_m: float, highest_m: float, floor_z_m: float, voxel_size_m: float
) -> tuple[int, int, int]:
    """Return `FusionInput.ooi_bounds`; a voxel counts by its centre.

    Args:
        lowest_m: Height above the floor up to which nothing is the object of interest.
        highest_m: Height above the floor from which nothing is.
        floor_z_m: Height of the floor, world frame.
        voxel_size_m: Edge of a voxel.
    """
    heights_m = (-UNDERFOOT_M, max(lowest_m, -UNDERFOOT_M), highest_m)
    low, high, top = (
        math.floor(min(floor_z_m + z, _EVERYWHERE_M) / voxel_size_m + 0.5 + 1e-6) for z in heights_m
    )
    return low, high, top


def energy_table(likelihood_floor: float) -> NDArray[np.float32]:
    """Return (256,) float32: -log(max(i / 255, floor)) in steps of 1 / `STEPS_PER_NAT`."""
    p = np.maximum(np.arange(256) / 255.0, likelihood_floor)
    return (-np.log(p) * STEPS_PER_NAT).astype(np.float32)


def prior_log_odds(labels: int, alias: int) -> np.float32:
    """Return log p(O) / p(not O) before any image: the labels and the OOI are equally likely."""
    return np.float32(-np.log(max(labels if alias < 0 else labels - 1, 1)))


@njit(cache=True, nogil=True, inline="always")
def exp_of_steps(energy):
    """Return exp(-energy / STEPS_PER_NAT), absolute error below 1e-6, in vectorisable float32."""
    y = energy * np.float32(-1.0 / (32 * STEPS_PER_NAT))
    c2, c3 = np.float32(1 / 2), np.float32(1 / 6)
    c4, c5 = np.float32(1 / 24), np.float32(1 / 120)
    one = np.float32(1.0)
    p = one + y * (one + y * (c2 + y * (c3 + y * (c4 + y * c5))))
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    return p * p


@_SUMS
def _sums(energy, row, weights, n):
    """Return the sums over a row's first n entries of p and of weights * p, p = exp(-energy)."""
    total, weighted = np.float32(0.0), np.float32(0.0)
    for j in range(n):
        p = exp_of_steps(np.float32(energy[row, j]))
        total += p
        weighted += weights[j] * p
    return total, weighted


@_SUMS
def add_energies(energy, row, heat, v, u, table, after, bits, n):
    """Write a row's energies plus those of pixel (v, u) to `after`; return the least of them.

    `bits` is `after` seen as int32, one longer than a row. Positive floats have the order of their
    bits, and only the least of whole numbers is found in vector registers.
    """
    for j in range(n):
        after[j] = table[heat[v, u, j]]
    for j in range(n):
        after[j] = after[j] + np.float32(energy[row, j])
    low = np.int32(0x7FFFFFFF)
    for j in range(n):
        low = min(low, bits[j])
    last = after.shape[0] - 1
    bits[last] = low
    return after[last]


@_SUMS
def store_energies(energy, row, after, low, rounding, weights, n):
    """Store a row's energies relative to the least.

    Returns:
        The sums of `_sums` for what was stored, and the first label of least energy with that
        energy: 256 * energy + label. `rounding`, 0 to 1, is added before the fraction is cut off.
    """
    total, weighted = np.float32(0.0), np.float32(0.0)
    top = np.float32(ENERGY_MAX)
    best = np.int32(0x7FFFFFFF)
    for j in range(n):
        code = np.int32(min(after[j] - low + rounding, top))
        energy[row, j] = np.uint8(code)
        best = min(best, np.int32(np.int32(code << 8) | np.int32(j)))
        p = exp_of_steps(np.float32(code))
        total += p
        weighted += weights[j] * p
    return total, weighted, best


@INNER
def _log_sum_but(energy, n, alias):
    """Return log of the sum of exp(-energy) over the entries other than `alias`."""
    low = np.float32(1e9)
    for j in range(n):
        if j != alias:
            low = min(low, np.float32(energy[j]))
    total = np.float32(0.0)
    for j in range(n):
        if j != alias:
            total += exp_of_steps(min(np.float32(energy[j]) - low, np.float32(ENERGY_MAX)))
    return np.log(total) - low * np.float32(1.0 / STEPS_PER_NAT)


@INNER
def reorder_channels(heat, v, u, channel, out, n):
    """Copy the channels of pixel (v, u) in the map's order; missing labels get 0.

    Returns:
        True if a label is missing.
    """
    missing = False
    for j in range(n):
        c = channel[j]
        out[0, 0, j] = heat[v, u, c] if c >= 0 else 0
        missing = missing or c < 0
    return missing


@INNER
def fill_missing(energy, row, channel, after, n):
    """Keep the share of labels that the heatmap lacks; return the least of `after`.

    Their likelihood is taken to be the mean over the labels that it has.
    """
    before_sum, after_sum = 0.0, 0.0
    for j in range(n):
        if channel[j] >= 0:
            before_sum += np.exp(-np.float64(energy[row, j]) / STEPS_PER_NAT)
            after_sum += np.exp(-after[j] / STEPS_PER_NAT)
    neutral = np.float32(0.0)
    if before_sum > 0.0:
        neutral = np.float32(np.log(before_sum / after_sum) * STEPS_PER_NAT)
    low = np.float32(1e9)
    for j in range(n):
        if channel[j] < 0:
            after[j] = np.float32(energy[row, j]) + neutral
        low = min(low, after[j])
    return low


@INNER
def summarise_row(energy, row, weights, n):
    """Return a row's label, confidence, proximity and normaliser."""
    total, weighted = _sums(energy, row, weights, n)
    best = least_energy(energy, row, n)
    confidence = share_code(exp_of_steps(np.float32(energy[row, best])), total)
    return best, confidence, share_code(weighted, total), np.log(total)


@INNER
def least_energy(energy, row, n):
    """Return the first label of least energy in a row."""
    best = 0
    for j in range(1, n):
        if energy[row, j] < energy[row, best]:
            best = j
    return best


@njit(cache=True, nogil=True, inline="always")
def share_code(part, total):
    """Return part / total in units of 1/254."""
    return np.uint8(np.float32(254.0) * min(part / total, np.float32(1.0)) + np.float32(0.5))


@INNER
def alias_log_mean(energy, row, after, n, alias):
    """Return log sum_i q_i h_i over the labels other than `alias`, which is the OOI itself."""
    return np.float32(_log_sum_but(after, n, alias) - _log_sum_but(energy[row], n, alias))


@_SUMS
def sum_after(after, low, n):
    """Return the sum of exp(-(after - low)) over the first n entries."""
    total, top = np.float32(0.0), np.float32(14 * STEPS_PER_NAT)
    for j in range(n):
        total += exp_of_steps(min(after[j] - low, top))
    return total


@INNER
def rounding_of(revision, voxel):
    """Return the rounding offset, 0 to 1, of an image's energies in a voxel.

    Multiples of the golden ratio fill the interval evenly, whichever run of images is taken; those
    of the voxel keep neighbours from being rounded alike.
    """
    shift = revision * 0.6180339887498949 + voxel * 0.7548776662466927
    return np.float32(shift - np.floor(shift))


@INNER
def fuse_maximum(energy, row, after, weights, n):
    """Keep the highest likelihood of any image (ablation); returns as `store_energies`.

    A new row starts at the greatest energy, so the least energy is that of the images.
    """
    for j in range(n):
        before = np.float32(energy[row, j])
        after[j] = min(after[j] - before, before)
    return store_energies(energy, row, after, np.float32(0.0), np.float32(0.5), weights, n)


@INNER
def maximum_log_odds(log_h, log_odds, is_first):
    """Return the larger of exp(log_h) and the stored probability, as log-odds (ablation)."""
    p = np.exp(log_h)
    odds = min(max(np.log(p / max(1.0 - p, 1e-9)), -LOG_ODDS_MAX), LOG_ODDS_MAX)
    return np.float32(odds if is_first else max(log_odds, odds))


@njit(cache=True, nogil=True, inline="always")
def ooi_code(log_odds):
    """Return p(O) in units of 1/254."""
    odds = np.float32(log_odds)
    rarer = exp_of_steps(min(abs(odds), np.float32(LOG_ODDS_MAX)) * np.float32(STEPS_PER_NAT))
    one = np.float32(1.0)
    share = (rarer if odds < np.float32(0.0) else one) / (one + rarer)
    return np.uint8(np.float32(254.0) * share + np.float32(0.5))
