import math

import numpy as np
import pytest
from scipy import ndimage

from ippon.evaluation.geodesic import GeodesicField
from ippon.planning.taut_paths import is_straight
from ippon.simulation.robot.navigation_grid import NavigationGrid
from tests.reference import floor as reference


def _grid(free, cell=0.05):
    region, _ = ndimage.label(free, structure=np.ones((3, 3)))
    return NavigationGrid(
        origin=(0.0, 0.0),
        cell_m=cell,
        clearance_m=ndimage.distance_transform_edt(free) * cell,
        free=free,
        region=region.astype(np.int32),
    )


def _maze(seed, size=15):
    rng = np.random.default_rng(seed)
    free = np.ones((size, size), bool)
    for _ in range(4):
        i, j = rng.integers(1, size - 3, 2)
        w, h = rng.integers(1, 6, 2)
        free[i : i + w, j : j + h] = False
    free[[0, -1], :] = free[:, [0, -1]] = True
    return free


def test_over_open_floor_the_distance_is_the_straight_line_in_every_direction():
    field = GeodesicField(_grid(np.ones((120, 100), bool)), np.array([[3.0, 2.5]]))
    for x, y in np.random.default_rng(0).uniform((0.05, 0.05), (5.9, 4.9), (200, 2)):
        assert field.distance_from(x, y) == pytest.approx(math.hypot(x - 3.0, y - 2.5), abs=1e-9)


def test_around_the_end_of_a_wall_it_is_two_straight_lines():
    free = np.ones((120, 100), bool)
    free[60, :70] = False
    field = GeodesicField(_grid(free), np.array([[1.0, 0.5]]))
    corner = (3.0, 3.5)
    expected = math.hypot(corner[0] - 1.0, corner[1] - 0.5) + math.hypot(
        5.5 - corner[0], 0.25 - 3.5
    )
    assert field.distance_from(5.5, 0.25) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("seed", range(6))
def test_it_agrees_with_the_visibility_graph(seed):
    free = _maze(seed)
    sources = np.argwhere(free)[[5, -7]]
    exact = reference.exact_distances(free, sources)
    grid = _grid(free, cell=1.0)
    field = GeodesicField(grid, grid.points_of(sources)).distance_m
    for cell, d in exact.items():
        if math.isinf(d):
            assert math.isinf(field[cell])
        else:
            assert d - 1e-9 <= field[cell] <= 1.02 * d + 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_straightness_agrees_with_dense_sampling(seed):
    free = _maze(seed)
    cells = np.argwhere(free)
    rng = np.random.default_rng(seed)
    for a, b in rng.integers(len(cells), size=(300, 2)):
        p, q = cells[a], cells[b]
        got = is_straight(free, float(p[0]), float(p[1]), float(q[0]), float(q[1]))
        assert got == reference.is_straight(free, tuple(p), tuple(q)), (p, q)


def test_distances_hold_the_triangle_inequality_and_are_symmetric():
    grid = _grid(_maze(3, 40), cell=0.1)
    points = grid.points_of(np.argwhere(grid.free)[[10, 400, 900, -20]])
    fields = [GeodesicField(grid, p[None]) for p in points]
    d = np.array([[f.distance_from(*p) for p in points] for f in fields])
    np.testing.assert_allclose(d, d.T, rtol=0.01, atol=1e-9)
    for a in range(4):
        for b in range(4):
            for c in range(4):
                assert d[a, c] <= 1.02 * (d[a, b] + d[b, c]) + 1e-9


def test_it_never_undercuts_the_straight_line_between_the_centres():
    grid = _grid(_maze(5, 40), cell=0.1)
    source = grid.points_of(np.argwhere(grid.free)[:1])
    field = GeodesicField(grid, source)
    for x, y in np.random.default_rng(1).uniform(0.05, 3.85, (300, 2)):
        assert field.distance_from(x, y) >= math.hypot(x - source[0, 0], y - source[0, 1]) - 0.15


def test_without_path_target_or_floor_the_distance_is_infinite():
    free = np.ones((40, 40), bool)
    free[20] = False
    grid = _grid(free)
    assert math.isinf(GeodesicField(grid, np.array([[0.5, 0.5]])).distance_from(1.5, 0.5))
    assert math.isinf(GeodesicField(grid, np.empty((0, 2))).distance_from(0.5, 0.5))
    assert math.isinf(GeodesicField(grid, np.array([[90.0, 0.0]])).distance_from(0.5, 0.5))
    assert math.isinf(GeodesicField(grid, np.array([[0.5, 0.5]])).distance_from(500.0, 0.0))


def test_a_position_just_off_the_free_floor_counts_from_its_edge():
    free = np.zeros((40, 40), bool)
    free[10:30, 10:30] = True
    field = GeodesicField(_grid(free), np.array([[1.0, 1.0]]))
    assert field.distance_from(0.4, 1.0) == pytest.approx(0.6, abs=0.02)
    assert math.isinf(field.distance_from(0.1, 1.0))
