"""The paper's Bayes filter over the common objects and the object of interest.

(Sec. Object Probability Mapping.) With equal priors, p(v | I_1..k) is proportional to
p(v | I_k) p(v | I_1..k-1) over {C_1 .. C_N, O}. The posterior is kept in two parts that each update
alone: q_j = p(C_j | not O), and L = log p(O) / p(not O), with q before its update on the right:

    q_j <- q_j h_j / sum_i q_i h_i        L <- L + log h_O - log sum_i q_i h_i

so that p(O) = sigmoid(L), p(C_j) = q_j (1 - p(O)), which is the joint filter, and a new object of
interest resets one number a voxel. Where the object of interest is itself the common label a, the
same holds with h_O = h_a and the sums over the labels other than a.
"""

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.mapping.arrays import NOT_MAPPED
from ippon.mapping.surface_rows import ENERGY_MAX, NO_LABEL, STEPS_PER_NAT, take_surface_row

LOG_ODDS_MAX: Final = 10.0
"""p(O) stays within 4.5e-5 of 0 and 1, so that it can recover."""
OUT_OF_ROWS: Final = -1
COLOR_MEMORY: Final = 8
"""Observations that the running mean of the colour remembers."""

BAYES: Final = 0
MAXIMUM: Final = 1
NONE: Final = -1


class FusionInput(NamedTuple):
    """One heatmap and how to read it, as the kernel takes it."""

    probabilities: NDArray[np.uint8]
    """(h, w, C); (1, 1, 1) when the frame has no heatmap."""
    has_heatmap: bool
    channel: NDArray[np.int64]
    """(N,) channel of each map label, `NONE` for labels that the heatmap lacks."""
    ooi_channel: int
    """Channel of the map's OOI, `NONE` when the heatmap was not asked for it."""
    ooi_alias: int
    """Map label that is the OOI itself, `NONE` when the OOI is no common object."""
    energy_of: NDArray[np.float32]
    """(256,) -log of a heatmap value in steps of 1 / `STEPS_PER_NAT`, whole numbers."""
    common_max_m: float
    ooi_max_m: float
    mode: int
    """`BAYES` or `MAXIMUM`."""
    levels: NDArray[np.uint8]
    """(N,) proximity level of each label."""
    level_probability: NDArray[np.float32]
    """(N,) l(O | C_j) of each label."""
    suppressed: NDArray[np.float64]
    """(K, 4) balls in which the OOI was rejected: centre and radius, metres."""


def energy_table(likelihood_floor: float) -> NDArray[np.float32]:
    """Return (256,) float32: -log(max(i / 255, floor)) in whole steps of 1 / `STEPS_PER_NAT`."""
    p = np.maximum(np.arange(256) / 255.0, likelihood_floor)
    return np.round(-np.log(p) * STEPS_PER_NAT).astype(np.float32)


@njit(cache=True, nogil=True, inline="always")
def _exp_of_steps(energy):
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


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "reassoc", "contract"})
def sum_of_exps(energy, n):
    """Return the sum of exp(-energy / STEPS_PER_NAT) of the first n entries."""
    total = np.float32(0.0)
    for j in range(n):
        total += _exp_of_steps(np.float32(energy[j]))
    return total


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "reassoc", "contract"})
def _weighted_sum(energy, weights, n):
    total = np.float32(0.0)
    for j in range(n):
        total += weights[j] * _exp_of_steps(np.float32(energy[j]))
    return total


@njit(cache=True, nogil=True, fastmath={"nnan", "ninf", "nsz", "reassoc", "contract"})
def _least(values, n):
    low = np.float32(1e9)
    for j in range(n):
        low = min(low, values[j])
    return low


@njit(cache=True, nogil=True)
def _log_sum_but(energy, n, alias):
    """Return log of the sum of exp(-energy / STEPS_PER_NAT) over the entries other than `alias`."""
    low = np.float32(1e9)
    for j in range(n):
        if j != alias:
            low = min(low, np.float32(energy[j]))
    total = np.float32(0.0)
    for j in range(n):
        if j != alias:
            total += _exp_of_steps(min(np.float32(energy[j]) - low, np.float32(ENERGY_MAX)))
    return np.log(total) - low * np.float32(1.0 / STEPS_PER_NAT)


@njit(cache=True, nogil=True)
def _observed_energies(surface, row, heat, fusion, n, table, after):
    """Write energy + observed energy of every label to `after`.

    A label that the heatmap lacks keeps its share: its likelihood is the mean over the others.
    """
    energy = surface.energy[row]
    missing = False
    for j in range(n):
        c = fusion.channel[j]
        if c < 0:
            missing = True
        else:
            after[j] = np.float32(energy[j]) + table[heat[c]]
    if not missing:
        return
    before_sum, after_sum = 0.0, 0.0
    for j in range(n):
        if fusion.channel[j] >= 0:
            before_sum += _exp_of_steps(np.float32(energy[j]))
            after_sum += np.exp(-after[j] / STEPS_PER_NAT)
    if before_sum <= 0.0 or after_sum <= 0.0:
        after[:n] = energy[:n]
        return
    neutral = np.float32(np.round(np.log(before_sum / after_sum) * STEPS_PER_NAT))
    for j in range(n):
        if fusion.channel[j] < 0:
            after[j] = np.float32(energy[j]) + neutral


@njit(cache=True, nogil=True)
def _store_common(surface, row, n, after, fusion, fresh):
    """Take over the common objects' posterior and what is derived from it."""
    energy = surface.energy[row]
    if fusion.mode == MAXIMUM:
        # `after` holds energy + observation; the maximum of two likelihoods is the lesser energy.
        for j in range(n):
            seen = after[j] - np.float32(energy[j])
            after[j] = seen if fresh else min(seen, np.float32(energy[j]))
    low = np.float32(0.0) if fusion.mode == MAXIMUM else _least(after, n)
    top = np.float32(ENERGY_MAX)
    for j in range(n):
        energy[j] = np.int16(min(after[j] - low, top))
    describe_row(surface, row, n, fusion.level_probability)


@njit(cache=True, nogil=True)
def describe_row(surface, row, n, level_probability):
    """Derive label, confidence, proximity and normaliser of a row from its energies."""
    energy = surface.energy[row]
    total = sum_of_exps(energy, n)
    best = 0
    for j in range(1, n):
        if energy[j] < energy[best]:
            best = j
    surface.log_norm[row] = np.log(total)
    surface.label[row] = best
    share = _exp_of_steps(np.float32(energy[best])) / total
    surface.confidence[row] = np.uint8(np.float32(254.0) * min(share, np.float32(1.0)) + 0.5)
    near = _weighted_sum(energy, level_probability, n) / total
    surface.proximity[row] = np.uint8(np.float32(254.0) * min(near, np.float32(1.0)) + 0.5)


@njit(cache=True, nogil=True)
def _observe_ooi(surface, row, n, after, heat, fusion, fresh):
    """Update the OOI's log-odds; `after` holds the common energies of before plus this image's."""
    h = fusion.energy_of[heat[fusion.ooi_channel]] * np.float32(-1.0 / STEPS_PER_NAT)
    if fusion.mode == MAXIMUM:
        p = np.exp(h)
        odds = np.log(p / max(1.0 - p, 1e-9))
        log_odds = odds if fresh else max(surface.log_odds[row], odds)
    else:
        before = _log_sum_but(surface.energy[row], n, fusion.ooi_alias)
        log_odds = surface.log_odds[row] + h - (_log_sum_but(after, n, fusion.ooi_alias) - before)
    surface.log_odds[row] = min(max(log_odds, -LOG_ODDS_MAX), LOG_ODDS_MAX)


@njit(cache=True, nogil=True)
def ooi_code(log_odds):
    """Return p(O) in units of 1/254."""
    return np.uint8(254.0 / (1.0 + np.exp(-log_odds)) + 0.5)


@njit(cache=True, nogil=True)
def _is_suppressed(pools, row, k, suppressed, voxel_size):
    for s in range(suppressed.shape[0]):
        x = (pools.coord[row, 0] * 8 + (k >> 6) + 0.5) * voxel_size - suppressed[s, 0]
        y = (pools.coord[row, 1] * 8 + ((k >> 3) & 7) + 0.5) * voxel_size - suppressed[s, 1]
        z = (pools.coord[row, 2] * 8 + (k & 7) + 0.5) * voxel_size - suppressed[s, 2]
        if x * x + y * y + z * z <= suppressed[s, 3] * suppressed[s, 3]:
            return True
    return False


@njit(cache=True, nogil=True)
def _blend_color(surface, row, color):
    count = min(int(surface.color_count[row]) + 1, COLOR_MEMORY)
    for c in range(3):
        old = int(surface.color[row, c])
        surface.color[row, c] = np.uint8((old * (count - 1) + int(color[c]) + count // 2) // count)
    surface.color_count[row] = count


@njit(cache=True, nogil=True)
def fuse_kernel(
    entries,
    n_entries,
    stride,
    depth,
    color,
    fusion,
    labels,
    voxel_size,
    pools,
    surface,
    revision,
):
    """Give each listed surface voxel this image's colour and label probabilities, once.

    Args:
        entries: (n, 3) pool row, voxel, sample (see `update_kernel`).
        n_entries: Rows of `entries`.
        stride: Pixels between samples.
        depth: (H + 2, W + 2) padded depth.
        color: (H, W, 3) RGB.
        fusion: The heatmap, or none.
        labels: Number of common labels.
        voxel_size: Metres.
        pools: The map's pools, updated.
        surface: Surface rows, updated.
        revision: Map revision of this image.

    Returns:
        Number of voxels that a heatmap updated; `OUT_OF_ROWS` when a voxel found no surface row.
    """
    height, width = color.shape[0], color.shape[1]
    samples_u = (width + stride - 1) // stride
    h, w = fusion.probabilities.shape[0], fusion.probabilities.shape[1]
    start = ENERGY_MAX if fusion.mode == MAXIMUM else 0
    prior = -np.log(max(labels, 1))
    after = np.zeros(surface.energy.shape[1], np.float32)
    table = fusion.energy_of
    fused = 0
    for e in range(n_entries):
        row, k, sample = entries[e, 0], entries[e, 1], entries[e, 2]
        v = min((sample // samples_u) * stride + stride // 2, height - 1)
        u = min((sample % samples_u) * stride + stride // 2, width - 1)
        slot = pools.slot[row, k]
        if slot == 0:
            slot = take_surface_row(surface, row * 512 + k, labels, start, prior)
            if slot == 0:
                return OUT_OF_ROWS
            pools.slot[row, k] = slot
        _blend_color(surface, slot, color[v, u])
        pools.appearance[row] = revision
        if not fusion.has_heatmap:
            continue
        d = depth[v + 1, u + 1]
        common, ooi = d <= fusion.common_max_m, d <= fusion.ooi_max_m and fusion.ooi_channel >= 0
        if not common and not ooi:
            continue
        fused += 1
        heat = fusion.probabilities[
            ((2 * v + 1) * h) // (2 * height), ((2 * u + 1) * w) // (2 * width)
        ]
        _observed_energies(surface, slot, heat, fusion, labels, table, after)
        if ooi:
            _observe_ooi(
                surface, slot, labels, after, heat, fusion, pools.ooi[row, k] == NOT_MAPPED
            )
            if _is_suppressed(pools, row, k, fusion.suppressed, voxel_size):
                surface.log_odds[slot] = -LOG_ODDS_MAX
            code = ooi_code(surface.log_odds[slot])
            if code != pools.ooi[row, k]:
                lowered = pools.ooi[row, k] != NOT_MAPPED and code < pools.ooi[row, k]
                pools.ooi[row, k] = code
                pools.revision[row] = revision
                if lowered:
                    pools.best_ooi[row] = best_of(pools, row)
                else:
                    pools.best_ooi[row] = max(pools.best_ooi[row], code)
        if common:
            _store_common(surface, slot, labels, after, fusion, surface.label[slot] == NO_LABEL)
            level = fusion.levels[surface.label[slot]]
            if level != pools.level[row, k]:
                pools.level[row, k] = level
                pools.revision[row] = revision
    return fused


@njit(cache=True, nogil=True)
def best_of(pools, row):
    """Return the highest OOI code of a block's voxels, 0 for none."""
    best = 0
    for k in range(512):
        code = pools.ooi[row, k]
        if code != NOT_MAPPED and code > best:
            best = code
    return best
