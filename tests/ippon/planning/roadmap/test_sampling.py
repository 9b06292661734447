"""Reachable floor and the places where viewpoints may go."""

import numpy as np
import pytest

from ippon.planning.roadmap.sampling import (
    SamplingConfig,
    draw_cell,
    mark_discs,
    open_cells,
    tight_cells,
)
from ippon.planning.terrain.body_limits import BodyLimits
from ippon.planning.terrain.floor_grid import OBSTACLE, OPEN, cell_centre
from ippon.planning.terrain.reachability import PASSED, STANDABLE, reachable_cells
from tests.ippon.planning.terrain.test_clearance import make_grid, random_kind
from tests.reference import planning_floor as reference

LIMITS = BodyLimits(
    radius=0.2, unseen_radius=0.12, slow_clearance=0.25, slow_fraction=0.4, speed=0.8
)


@pytest.mark.parametrize("seed", range(6))
def test_the_flood_agrees_with_a_plain_search(seed):
    grid = make_grid(random_kind(seed, share=0.015), origin=(4, -9))
    rng = np.random.default_rng(seed)
    x, y = (grid.origin + rng.random(2) * grid.kind.shape) * 0.1
    out = reachable_cells(grid, LIMITS, x, y, 0.03, 0.05)
    np.testing.assert_array_equal(out, reference.reachable(grid, LIMITS, x, y, 0.03, 0.05))


def test_a_closed_wall_cuts_the_floor_in_two():
    kind = np.full((40, 20), OPEN)
    kind[20, :] = OBSTACLE
    out = reachable_cells(make_grid(kind), LIMITS, 1.0, 1.0, 0.0, 0.05)
    assert out[:18].any()
    assert not out[20:].any()


def test_a_robot_too_close_to_a_wall_is_not_cut_off():
    kind = np.full((40, 20), OPEN)
    kind[20, :] = OBSTACLE
    out = reachable_cells(make_grid(kind), LIMITS, 1.95, 1.0, 0.0, 0.05)
    assert out[:18].any()


@pytest.mark.parametrize("seed", range(3))
def test_filling_every_open_place_leaves_none_and_crowds_nobody(seed):
    grid = make_grid(random_kind(seed, share=0.01))
    reachable = reachable_cells(grid, LIMITS, 1.5, 1.5, 0.0, 0.05)
    rng = np.random.default_rng(seed)
    nodes = np.zeros((0, 2))
    for _ in range(500):
        places = np.argwhere(open_cells(reachable, grid, nodes, 0.5))
        if not len(places):
            break
        nodes = np.vstack([nodes, cell_centre(grid, *draw_cell(places, grid, rng, 4, 0.5))])
    apart = np.linalg.norm(nodes[:, None] - nodes[None], axis=2) + 10.0 * np.eye(len(nodes))
    assert apart.min() >= 0.5 - 1e-9
    covered = np.zeros_like(reachable)
    mark_discs(covered, grid, nodes, 0.5, 1)
    assert not ((reachable == STANDABLE) & (covered == 0)).any()


def test_roomy_places_are_preferred():
    kind = np.full((40, 40), OPEN)
    kind[:, 0] = OBSTACLE
    grid = make_grid(kind)
    places = np.array([[20, 2], [20, 10]])
    rng = np.random.default_rng(0)
    drawn = [draw_cell(places, grid, rng, 6, 0.5)[1] for _ in range(60)]
    assert drawn.count(10) > 50


def test_a_tight_place_beside_an_object_serves_where_no_roomier_one_is_near():
    grid = make_grid(np.full((30, 10), OPEN))
    reachable = np.full((30, 10), PASSED, dtype=np.uint8)
    reachable[:10] = STANDABLE
    objects = np.ones_like(reachable)
    objects[25:] = 0
    tight = tight_cells(objects, reachable, grid, 0.3, 0.22)
    assert not tight[:12].any(), "roomy, or beside it"
    assert tight[13:25].all()
    assert not tight[25:].any(), "far from the object"
    kind = np.full((30, 10), OPEN)
    kind[:, 0] = OBSTACLE
    tight = tight_cells(objects, reachable, make_grid(kind), 0.3, 0.22)
    assert not tight[:, :3].any(), "the body would touch"
    assert tight[13:25, 3:].all()


def test_spacings_that_contradict_each_other_are_refused():
    with pytest.raises(ValueError, match="spacings must grow"):
        SamplingConfig(local_spacing_m=2.0)
