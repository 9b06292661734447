"""The filter by places against its slow twin, on the voxel in the middle of a wall."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from ippon.frame import Frame
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.place_pooling import pool
from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX, prior_log_odds
from ippon.mapping.objects.surface_voxels import NORM_STEPS, STEPS_PER_NAT
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap
from ippon.observation_model import MOST_NATS, ObservationModel, ObservationModels, ScoreTable
from ippon.vocabulary import MATTERPORT_40
from tests.reference.place_pooling import place_filter

LABELS = ("wall", "door", "picture", "table")
TABLE = ScoreTable(scores=(0.1, 0.4, 0.9), nats=(-1.0, 1.0, 6.0), not_recognised=-0.5)
MODELS = ObservationModels(
    [ObservationModel(source="x", kind="scores", provenance="test", table=TABLE)]
)
CAMERAS = ((0.02, 0.02), (-1.5, 0.02), (0.02, 0.8), (-1.5, 1.4))
"""Near and far before a wall at x = 1 m, and to its left: four places of the wall's middle."""

seen = st.lists(
    st.tuples(
        st.integers(0, len(CAMERAS) - 1),
        st.lists(st.integers(0, 255), min_size=len(LABELS) + 1, max_size=len(LABELS) + 1),
    ),
    min_size=1,
    max_size=8,
)


@pytest.fixture(scope="module")
def frames(tools):
    """One frame of each camera, all of which look at the middle of the wall."""
    world = tools.World([(1.0, -6.0, -6.0, 1.2, 6.0, 6.0)])
    return [
        world.frame(tools.look(x, y, 0.02, float(np.arctan2(0.02 - y, 1.0 - x))))
        for x, y in CAMERAS
    ]


def believed(frames: list[Frame], images) -> tuple[np.ndarray, float, float]:
    """Return q and L of the voxel in the middle, and log of the sum before q was scaled."""
    config = MapConfig(memory_limit_mb=64.0, max_camera_speed_m_s=1e9)
    voxel_map = VoxelMap(config, LABELS, MODELS)
    voxel_map.set_ooi("hat")
    for n, (camera, values) in enumerate(images):
        frame = frames[camera]
        rows = np.broadcast_to(np.array(values, np.uint8), (15, 20, len(values)))
        heatmap = Heatmap(
            labels=LABELS,
            ooi="hat",
            probabilities=np.ascontiguousarray(rows),
            kind="scores",
            source="x",
        )
        changed = {"stamp_ns": n * 10**9, "heatmap": heatmap}
        voxel_map.integrate(type(frame)(**{**_fields(frame), **changed}))
    surface, pools = voxel_map.surface, voxel_map._pools
    used = np.flatnonzero(surface.voxel >= 0)
    block, k = surface.voxel[used] // 512, surface.voxel[used] % 512
    inner = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
    centres = (pools.coord[block] * 8 + inner + 0.5) * config.voxel_size_m
    middle = used[np.linalg.norm(centres - (1.05, 0.05, 0.05), axis=1).argmin()]
    energy = surface.energy[middle, : len(LABELS)].astype(np.float64) / STEPS_PER_NAT
    return np.exp(-energy), float(surface.log_odds[middle]), surface.log_norm[middle] / NORM_STEPS


def _fields(frame: Frame) -> dict[str, object]:
    return {name: getattr(frame, name) for name in frame.__dataclass_fields__}


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(images=seen)
def test_what_is_believed_is_what_the_slow_twin_believes(frames, images):
    q, log_odds, log_norm = believed(frames, images)
    ratios = np.exp(TABLE.log_ratios("scores").astype(np.float64))
    values = np.array([values for _, values in images])
    prior = float(prior_log_odds(len(LABELS), -1))
    exact_q, exact_log_odds = place_filter([c for c, _ in images], ratios[values], prior)
    assert log_norm == pytest.approx(np.log(q.sum()), abs=2e-4), "posteriors sum to 1"
    assert log_odds == pytest.approx(exact_log_odds, abs=1e-3)
    # A place rounds the energy of each label by half a step at most, and thus the gap of two labels
    # by a step; the kernel's logarithms are exact to a few thousandths of a step. The bound on gaps
    # adds no error: of two gaps that differ by e, it makes two that differ by e at most.
    gap, exact_gap = np.log(q.max() / q), np.log(exact_q.max() / exact_q)
    places = len({camera for camera, _ in images})
    assert np.abs(gap - exact_gap).max() < (places + 0.05) / STEPS_PER_NAT


@njit(cache=True)
def pooled(likelihoods, before, count):
    """Return the energies after `count` images from one place, in turn, and the least of them."""
    images, n = likelihoods.shape
    sums, base = np.zeros((1, n), np.float32), before.reshape(1, n)
    after, mantissa = np.zeros(n + 1, np.float32), np.zeros(n, np.float32)
    bits, mantissa_bits = after.view(np.int32), mantissa.view(np.int32)
    low = np.float32(0.0)
    for k in range(count):
        one = likelihoods[k % images]
        low = pool(sums, base, 0, k + 1, one, after, bits, mantissa, mantissa_bits, n)
    return after[:n], low


@pytest.mark.slow
def test_energies_are_exact_to_a_thousandth_of_a_step():
    rng = np.random.default_rng(1)
    likelihoods = np.exp(rng.uniform(-MOST_NATS, MOST_NATS, (3, 2000))).astype(np.float32)
    # All mantissas of a float, its border at the square root of one half among them.
    likelihoods[:, :1000] = np.linspace(0.5, 2.0, 1000)
    likelihoods[:, :3] = 1.0, np.sqrt(0.5), np.nextafter(np.float32(np.sqrt(0.5)), np.float32(0.0))
    before = rng.integers(0, 256, 2000).astype(np.uint8)
    after, low = pooled(likelihoods, before, 3)
    offset = 2.0 * STEPS_PER_NAT * MOST_NATS
    mean = likelihoods.astype(np.float64).mean(axis=0)
    exact = before - STEPS_PER_NAT * np.log(mean) + offset
    assert np.abs(after - exact).max() < 2e-4
    assert low == after.min()
    assert (after > 0.0).all()


weak_scores = st.lists(st.integers(0, 110), min_size=len(LABELS) + 1, max_size=len(LABELS) + 1)


@pytest.mark.slow
@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    places=st.lists(
        st.lists(weak_scores, min_size=1, max_size=3), min_size=2, max_size=len(CAMERAS)
    ),
    draw=st.data(),
)
def test_the_order_of_places_does_not_matter_to_the_object(frames, places, draw):
    visits = [[(camera, values) for values in images] for camera, images in enumerate(places)]
    _, log_odds, _ = believed(frames, [one for visit in visits for one in visit])
    assert abs(log_odds) < LOG_ODDS_MAX, "these scores are too weak to saturate"
    shuffled = [one for visit in draw.draw(st.permutations(visits)) for one in visit]
    assert believed(frames, shuffled)[1] == pytest.approx(log_odds, abs=1e-3)


@pytest.mark.slow
def test_a_million_weak_wrong_scores_from_one_place_never_make_a_find():
    n = len(MATTERPORT_40) + 1
    weak = np.float32(np.exp(ObservationModels().of_source("", "scores").table.log_ratios("scores")[
        round(0.35 * 255)
    ]))  # fmt: skip

    likelihood = np.ones((1, n), np.float32)
    likelihood[0, n - 1] = weak

    def probability(count):
        after, _ = pooled(likelihood, np.zeros(n, np.uint8), count)
        nats = -(after.astype(np.float64) - 2.0 * STEPS_PER_NAT * MOST_NATS)
        q = np.exp(nats / STEPS_PER_NAT)
        return q[-1] / q.sum()

    one = probability(1)
    assert weak > 5.0, "each of them speaks for the label"
    assert 0.1 < one < 0.5
    assert probability(10**6) == pytest.approx(one, abs=0.01)
