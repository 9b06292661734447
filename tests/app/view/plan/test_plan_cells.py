import numpy as np

from app.view.plan.plan_cells import Cell, plan_cells

VOXEL_M = 0.1


def _cells(columns, walls=()):
    """Plan of columns: (i, j) to the heights in voxels that are surface."""
    indices = np.array([(i, j, k) for (i, j), ks in columns.items() for k in ks])
    is_wall = np.array([(i, j) in walls for (i, j), ks in columns.items() for _ in ks])
    return plan_cells(indices, is_wall, VOXEL_M)


def test_floor_furniture_and_walls_are_told_apart():
    plan = _cells(
        {
            (0, 0): [-1],
            (1, 0): [-1, 4],
            (2, 0): range(26),
            (3, 0): [-1, 25],
            (4, 0): [19],
        }
    )
    expected = [Cell.FLOOR, Cell.FURNITURE, Cell.WALL, Cell.FLOOR, Cell.UNKNOWN]
    assert plan.cells[:, 0].tolist() == expected


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
    assert plan_cells(np.empty((0, 3), np.int64), np.empty(0, bool), VOXEL_M) is None
