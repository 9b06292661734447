"""Straight ways over floor that was never seen."""

import numpy as np
import pytest

from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.floor_grid import OBSTACLE, OPEN, UNSEEN
from ippon.planning.terrain.unseen_shortcut import unseen_shortcut_m
from tests.ippon.planning.terrain.test_clearance import make_grid, random_kind
from tests.reference import planning_floor as reference

LIMITS = BodyLimits(
    radius=0.2, unseen_radius=0.12, slow_clearance=0.25, slow_fraction=0.4, speed=0.8
)


def across(kind: np.ndarray) -> float:
    grid = make_grid(kind, origin=(0, 0))
    path = np.array([[0.55, 2.05], [2.0, 3.0], [3.55, 2.05]])
    return unseen_shortcut_m(grid, LIMITS, 0.02, path)


def test_only_what_was_never_seen_counts():
    kind = np.full((41, 41), OPEN, np.uint8)
    assert across(kind) == 0.0
    kind[15:25] = UNSEEN
    assert across(kind) == pytest.approx(1.0, abs=0.1)


def test_a_known_obstacle_on_the_line_excludes_a_shortcut():
    kind = np.full((41, 41), UNSEEN, np.uint8)
    kind[20, 20] = OBSTACLE
    assert across(kind) == 0.0


def test_an_empty_path_has_no_shortcut():
    grid = make_grid(np.full((41, 41), UNSEEN, np.uint8), origin=(0, 0))
    assert unseen_shortcut_m(grid, LIMITS, 0.02, np.zeros((0, 2))) == 0.0


@pytest.mark.parametrize("seed", range(6))
def test_agrees_with_the_plain_twin(seed):
    grid = make_grid(random_kind(seed, share=0.01), origin=(4, -9))
    rng = np.random.default_rng(seed)
    for _ in range(20):
        ends = (grid.origin + rng.random((2, 2)) * grid.kind.shape) * 0.1
        plain = reference.unseen_shortcut_m(grid, LIMITS, 0.02, *ends)
        assert unseen_shortcut_m(grid, LIMITS, 0.02, ends) == pytest.approx(plain)
