"""Arrays with the evidence for several objects of interest, one column for each."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.arrays import INNER, NOT_MAPPED
from ippon.mapping.objects.posterior_batch import PosteriorBatch, make_posterior_batch

MAX_GOALS: Final = 8
"""Objects of interest that a map holds at once."""


class GoalArrays(NamedTuple):
    """Evidence for K objects of interest; rows are those of `SurfaceVoxels`."""

    log_odds: NDArray[np.float32]
    """(R, K) of each goal against the common objects."""
    code: NDArray[np.uint8]
    """(R, K) p(v in O) in units of 1/254, `NOT_MAPPED` before the first image of a goal."""
    base_log_odds: NDArray[np.float32]
    """(W, K) `log_odds` before the current place; rows are those of `PlaceAccumulators`."""
    sums: NDArray[np.float32]
    """(W, K) sum of the current place's likelihoods of each goal."""
    images: NDArray[np.int32]
    """(W, K) images in `sums`."""
    missing: NDArray[np.bool_]
    """(K,) whether a goal is still searched for, and counts in the map's `ooi`."""


class GoalFusion(NamedTuple):
    """Properties of the K goals for one image, as kernel arguments; see `FusionInput`."""

    channel: NDArray[np.int64]
    """(K,) channel of each goal in the heatmap, `NONE` where it was not asked for."""
    alias: NDArray[np.int64]
    """(K,) map label that is the goal itself, or `NONE`."""
    prior: NDArray[np.float32]
    """(K,) see `prior_log_odds`."""
    likelihood_of: NDArray[np.float32]
    """(T, 256) likelihood ratio of a heatmap value, by the observation model."""
    table_of: NDArray[np.int64]
    """(K,) row of `likelihood_of`."""
    clear_m: NDArray[np.float64]
    """(K,) depth up to which a miss is evidence."""
    bounds: NDArray[np.int64]
    """(K, 3) voxel layers, see `FusionInput.ooi_bounds`."""
    suppressed: NDArray[np.float64]
    """(S, 4) balls in which a goal was rejected: centre and radius, metres."""
    suppressed_goal: NDArray[np.int64]
    """(S,) that goal."""


class GoalWork(NamedTuple):
    """Working memory of `fuse_goals_kernel`."""

    is_new: NDArray[np.bool_]
    """(A,) whether a surface voxel has no row yet."""
    wanted: NDArray[np.bool_]
    """(K,) whether an image updates a goal in a voxel."""
    goal: NDArray[np.int64]
    """(A * K,) goal of each entry of `batch`."""
    batch: PosteriorBatch
    """Batch of A * K posteriors."""


def make_goal_arrays(rows: int, places: int, goals: int) -> GoalArrays:
    """Reserve the evidence of some goals; its memory is backed when it is first written.

    Args:
        rows: R, rows of `SurfaceVoxels`.
        places: W, rows of `PlaceAccumulators`.
        goals: K.
    """
    return GoalArrays(
        log_odds=np.zeros((rows, goals), np.float32),
        code=np.zeros((rows, goals), np.uint8),
        base_log_odds=np.zeros((places, goals), np.float32),
        sums=np.zeros((places, goals), np.float32),
        images=np.zeros((places, goals), np.int32),
        missing=np.ones(goals, np.bool_),
    )


def make_goal_work(ahead: int, goals: int) -> GoalWork:
    """Reserve working memory for batches of `ahead` voxels."""
    return GoalWork(
        is_new=np.zeros(ahead, np.bool_),
        wanted=np.zeros(goals, np.bool_),
        goal=np.zeros(ahead * goals, np.int64),
        batch=make_posterior_batch(ahead * goals),
    )


@INNER
def highest_code(code, slot, missing):
    """Return the highest p(v in O) of the missing goals in a voxel, `NOT_MAPPED` without any."""
    best = -1
    for g in range(missing.shape[0]):
        if missing[g] and code[slot, g] != NOT_MAPPED:
            best = max(best, np.int64(code[slot, g]))
    return np.uint8(NOT_MAPPED if best < 0 else best)
