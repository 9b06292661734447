import numpy as np
import pytest

from app.view.plan.plan_cells import Cell, plan_cells

VOXEL_M = 0.1


def _cells(columns, walls=(), floor_z_m=0.0):
    """Plan of columns: (i, j) to the heights in voxels that are surface."""
    indices = np.array([(i, j, k) for (i, j), ks in columns.items() for k in ks])
    is_wall = np.array([(i, j) in walls for (i, j), ks in columns.items() for _ in ks])
    return plan_cells(indices, is_wall, VOXEL_M, floor_z_m)


@pytest.mark.parametrize("floor", [0, 30, -13])
def test_floor_furniture_and_walls_are_told_apart_on_any_floor(floor):
    columns = {
        (0, 0): [-1],
        (1, 0): [-1, 4],
        (2, 0): range(26),
        (3, 0): [-1, 25],
        (4, 0): [19],
    }
    raised = {at: [floor + k for k in ks] for at, ks in columns.items()}
    plan = _cells(raised, floor_z_m=floor * VOXEL_M)
    expected = [Cell.FLOOR, Cell.FURNITURE, Cell.WALL, Cell.FLOOR, Cell.UNKNOWN]
    assert plan.cells[:, 0].tolist() == expected


def test_a_plan_shows_one_of_several_floors():
    columns = {(0, 0): [-1, 29], (1, 0): [-1, 4], (2, 0): range(26), (3, 0): [29, 34], (4, 0): [26]}
    below, above = (_cells(columns, floor_z_m=z).cells[:, 0].tolist() for z in (0.0, 3.0))
    assert below == [Cell.FLOOR, Cell.FURNITURE, Cell.WALL, Cell.UNKNOWN, Cell.UNKNOWN]
    assert above == [Cell.FLOOR, Cell.UNKNOWN, Cell.UNKNOWN, Cell.FURNITURE, Cell.UNKNOWN]


def test_a_wall_of_which_little_was_seen_is_known_by_its_label():
    seen = {(0, 0): [-1, 6, 7], (1, 0): [-1, 6, 7]}
    assert _cells(seen, walls={(1, 0)}).cells[:, 0].tolist() == [Cell.FURNITURE, Cell.WALL]


def test_the_corner_is_that_of_the_first_cell():
    plan = _cells({(-3, 7): [-1], (2, 9): [-1]})
    np.testing.assert_allclose(plan.origin_m, (-0.3, 0.7))
    np.testing.assert_allclose(plan.size_m, (0.6, 0.3))
    assert (plan.cells == Cell.UNKNOWN).sum() == 16


def test_four_cells_are_a_byte():
    plan = _cells({(0, 0): [-1], (0, 1): [4], (0, 2): range(26), (0, 4): [-1], (0, 3): [-1]})
    assert plan.packed() == bytes([1 + (2 << 2) + (3 << 4) + (1 << 6), 1])


def test_an_empty_map_has_no_plan():
    assert plan_cells(np.empty((0, 3), np.int64), np.empty(0, bool), VOXEL_M, 0.0) is None
