"""Update of several objects of interest by one image, before the common objects are updated.

Each goal is updated as the map's only object of interest would be (`update_by_places` and
`update_by_images`): from the state of the common objects before the image, and independently of the
other goals.
"""

import numpy as np

from ippon.compiling import njit
from ippon.mapping.arrays import INNER, NOT_MAPPED
from ippon.mapping.goal_layers.goal_arrays import highest_code
from ippon.mapping.objects.bayes_update import NEVER, is_suppressed_by
from ippon.mapping.objects.places import (
    N_OPENED,
    TAN_MARGIN,
    close_for_ooi,
    open_accumulator,
    place_of,
)
from ippon.mapping.objects.posterior_arithmetic import (
    MAXIMUM,
    PLACES,
    add_energies,
    alias_log_mean,
    fill_missing,
    maximum_log_odds,
    reorder_channels,
    sum_after,
)
from ippon.mapping.objects.posterior_batch import encode_ooi_posteriors
from ippon.mapping.objects.surface_fusion import AHEAD, fetch, show_ooi
from ippon.mapping.objects.surface_voxels import ENERGY_MAX, NORM_STEPS, STEPS_PER_NAT


@njit(cache=True, nogil=True)
def fuse_goals_kernel(
    entries,
    n_entries,
    work,
    goal_work,
    depth,
    color,
    fusion,
    goals,
    labels,
    voxel_size,
    pools,
    surface,
    accumulators,
    layers,
    revision,
):
    """Update the evidence for each goal in each listed surface voxel from one image.

    Args:
        entries: (n, 3) pool row, voxel, sample (see `update_kernel`).
        n_entries: Rows of `entries`.
        work: Working memory, as of `fuse_kernel`.
        goal_work: Working memory for the goals.
        depth: (H + 2, W + 2) padded depth.
        color: (H, W, 3) RGB.
        fusion: The heatmap, or none.
        goals: Properties of the goals.
        labels: Number of common labels.
        voxel_size: Metres.
        pools: The map's pools; `ooi` is updated.
        surface: Surface rows; those of new surface are allocated.
        accumulators: Places, opened.
        layers: Evidence for the goals, updated.
        revision: Map revision of this image.

    Returns:
        Number of voxels with a goal that the heatmap updated.
    """
    start = ENERGY_MAX if fusion.mode == MAXIMUM else 0
    asked, is_new, number = work.ahead, goal_work.is_new, goal_work.batch.number
    count, fused = len(goals.prior), 0
    for first in range(0, n_entries, AHEAD):
        ahead = min(AHEAD, n_entries - first)
        for a in range(ahead):
            row, k = entries[first + a, 0], entries[first + a, 1]
            is_new[a] = pools.slot[pools.slab[row], k] == 0
        fetch(entries, first, ahead, work, depth, color, fusion, labels, start, pools, surface)
        for a in range(ahead):
            if is_new[a] and asked[a, 0] != 0:
                for g in range(count):
                    layers.log_odds[asked[a, 0], g] = goals.prior[g]
                    layers.code[asked[a, 0], g] = NOT_MAPPED
        if not fusion.has_heatmap:
            continue
        if fusion.mode == PLACES:
            n = _update_by_places(
                entries, first, ahead, work, goal_work, fusion, goals, labels, voxel_size, pools,
                surface, accumulators, layers,
            )  # fmt: skip
        else:
            n = _update_by_images(
                entries, first, ahead, work, goal_work, fusion, goals, labels, voxel_size, pools,
                surface, layers,
            )  # fmt: skip
        encode_ooi_posteriors(goal_work.batch, n)
        _write(entries, first, n, work, goal_work, pools, layers, revision)
        for i in range(n):
            fused += np.int64(i == 0 or number[i] != number[i - 1])
    return fused


@INNER
def _update_by_places(
    entries, first, ahead, work, goal_work, fusion, goals, labels, voxel_size, pools, surface,
    accumulators, layers,
):  # fmt: skip
    """Update the goals with images pooled by place; return the length of the batch."""
    heat, coord, wanted, batch = (
        fusion.probabilities,
        pools.coord,
        goal_work.wanted,
        goal_work.batch,
    )
    table, table_of, channel = goals.likelihood_of, goals.table_of, goals.channel
    base, sums, images = layers.base_log_odds, layers.sums, layers.images
    for_ooi, settled = accumulators.for_ooi, fusion.settled
    x, y, z = fusion.camera_at
    n = 0
    for a in range(ahead):
        slot = work.ahead[a, 0]
        if slot == 0:
            continue
        row, k = entries[first + a, 0], entries[first + a, 1]
        d, v, u = work.measured[a], work.ahead[a, 1], work.ahead[a, 2]
        common, any_goal = d <= fusion.common_max_m, False
        for g in range(len(wanted)):
            wanted[g] = d <= fusion.ooi_max_m and channel[g] >= 0
            if wanted[g] and d > goals.clear_m[g]:
                # The object is too small in the image for a miss to be evidence.
                wanted[g] = table[table_of[g], heat[v, u, channel[g]]] > np.float32(1.0)
            any_goal = any_goal or wanted[g]
        if not common and not any_goal:
            continue
        dx = x - (coord[row, 0] * 8 + (k >> 6) + 0.5) * voxel_size
        dy = y - (coord[row, 1] * 8 + ((k >> 3) & 7) + 0.5) * voxel_size
        dz = z - (coord[row, 2] * 8 + (k & 7) + 0.5) * voxel_size
        place = place_of(dx, dy, dz)
        left = place_of(dx + TAN_MARGIN * dy, dy - TAN_MARGIN * dx, dz)
        right = place_of(dx - TAN_MARGIN * dy, dy + TAN_MARGIN * dx, dz)
        opened = accumulators.tally[N_OPENED]
        w = open_accumulator(
            surface, accumulators, slot, place, left, right, settled, labels, common, any_goal
        )
        if w == 0:
            continue
        if accumulators.tally[N_OPENED] != opened:
            for g in range(len(wanted)):
                base[w, g], sums[w, g], images[w, g] = layers.log_odds[slot, g], 0.0, 0
        for g in range(len(wanted)):
            if not (wanted[g] and for_ooi[w]):
                continue
            sums[w, g] += table[table_of[g], heat[v, u, channel[g]]]
            images[w, g] += 1
            if images[w, g] == 1:
                close_for_ooi(surface, accumulators, slot, w)
            batch.mean[n] = np.float32(images[w, g])
            batch.shift[n] = base[w, g] + np.log(sums[w, g])
            if not _may_be(goals, g, coord, row, k, voxel_size):
                batch.shift[n], batch.mean[n] = NEVER, np.float32(1.0)
            batch.number[n], goal_work.goal[n] = a, g
            n += 1
    return n


@INNER
def _update_by_images(
    entries, first, ahead, work, goal_work, fusion, goals, labels, voxel_size, pools, surface,
    layers,
):  # fmt: skip
    """Update the goals by the paper's filter; return the length of the batch."""
    after, bits, gathered = work.after, work.bits, work.gathered
    heat, table, bayes = fusion.probabilities, fusion.energy_of, fusion.mode != MAXIMUM
    energy, log_norm, batch = surface.energy, surface.log_norm, goal_work.batch
    log_odds, code, alias = layers.log_odds, layers.code, goals.alias
    per_step, per_norm_step = np.float32(-1.0 / STEPS_PER_NAT), np.float32(1.0 / NORM_STEPS)
    # A literal 0 has its own type, for which `add_energies` would be compiled again.
    only = np.int64(0)
    n = 0
    for a in range(ahead):
        slot, d = work.ahead[a, 0], work.measured[a]
        if slot == 0 or not d <= fusion.ooi_max_m:
            continue
        row, k = entries[first + a, 0], entries[first + a, 1]
        v, u = work.ahead[a, 1], work.ahead[a, 2]
        missing = False
        if fusion.in_order:
            low = add_energies(energy, slot, heat, v, u, table, after, bits, labels)
        else:
            missing = reorder_channels(heat, v, u, fusion.channel, gathered, labels)
            low = add_energies(energy, slot, gathered, only, only, table, after, bits, labels)
        if missing:
            low = fill_missing(energy, slot, fusion.channel, after, labels)
        mean = sum_after(after, low, labels)
        before = log_norm[slot] * per_norm_step
        for g in range(len(alias)):
            if goals.channel[g] < 0:
                continue
            log_h = table[heat[v, u, goals.channel[g]]] * per_step
            batch.mean[n] = np.float32(1.0)
            if not bayes:
                is_first = code[slot, g] == NOT_MAPPED
                batch.shift[n] = maximum_log_odds(log_h, log_odds[slot, g], is_first)
            elif alias[g] >= 0:
                likelihood = alias_log_mean(energy, slot, after, labels, alias[g])
                batch.shift[n] = log_odds[slot, g] + log_h - likelihood
            else:
                batch.mean[n] = mean
                batch.shift[n] = log_odds[slot, g] + log_h - low * per_step + before
            if not _may_be(goals, g, pools.coord, row, k, voxel_size):
                batch.shift[n] = NEVER
            batch.number[n], goal_work.goal[n] = a, g
            n += 1
    return n


@INNER
def _may_be(goals, g, coord, row, k, voxel_size):
    """Tell whether a goal may be in a voxel: not too low or high, nor where it was rejected."""
    layer, bounds = coord[row, 2] * 8 + (k & 7), goals.bounds
    if layer >= bounds[g, 2] or bounds[g, 0] <= layer < bounds[g, 1]:
        return False
    for s in range(goals.suppressed.shape[0]):
        if goals.suppressed_goal[s] == g and is_suppressed_by(
            coord, row, k, goals.suppressed, s, voxel_size
        ):
            return False
    return True


@INNER
def _write(entries, first, n, work, goal_work, pools, layers, revision):
    """Write a batch, and the highest posterior of each voxel to the map."""
    batch, slab_of, codes = goal_work.batch, pools.slab, pools.ooi
    number = batch.number
    for i in range(n):
        a, g = number[i], goal_work.goal[i]
        slot = work.ahead[a, 0]
        layers.log_odds[slot, g], layers.code[slot, g] = batch.shift[i], batch.ooi[i]
        if i + 1 < n and number[i + 1] == a:
            continue
        row, k = entries[first + a, 0], entries[first + a, 1]
        code = highest_code(layers.code, slot, layers.missing)
        if code != codes[slab_of[row], k]:
            show_ooi(codes, slab_of[row], pools.best_ooi, row, k, code)
            pools.revision[row] = revision
