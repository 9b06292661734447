import dataclasses
import json

import numpy as np
import pytest
from scipy import ndimage

from ippon.errors import SceneError
from ippon.robot import ZED
from ippon.simulation.robot.navigation_grid import (
    FINE_CELL_M,
    FloorCells,
    _closed,
    _draw_kernel,
    grid_of_triangles,
    navigation_grid,
    robot_grid,
)
from ippon.simulation.scene_reader import load_scene
from tests.locations import SHARED
from tests.reference import floor as reference

SCENES = SHARED / "scenes"


def _box(low, high):
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = np.array([(x, y, z) for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)], float)
    quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    return corners[np.array(faces)]


def _room(*boxes, size=4.0):
    floor = _box((0, 0, -0.1), (size, size, 0.0))
    return np.concatenate([floor, *[_box(*b) for b in boxes]])


def _grid(triangles, **changes):
    options = {"radius_m": 0.25, "height_m": 1.2, "max_step_m": 0.06} | changes
    return grid_of_triangles(triangles, **options)


@pytest.mark.slow
def test_cells_drawn_for_a_triangle_hold_all_its_points_and_few_others():
    rng = np.random.default_rng(3)
    for _ in range(25):
        triangle = rng.uniform(0.2, 2.8, (3, 3))
        out = np.zeros((30, 30), np.uint8)
        _draw_kernel(triangle[None], 0.0, 0.0, 0.1, 0.5, 2.0, out)
        naive = reference.touched_cells(triangle, 0.0, 0.0, 0.1, 0.5, 2.0, (30, 30))
        assert not (naive & (out == 0)).any()
        # The twin misses cells of which a triangle covers only a sliver; those border on its own.
        beside = ndimage.binary_dilation(naive, np.ones((3, 3)))
        assert not ((out > 0) & ~beside).any()
        assert (out > 0).sum() <= naive.sum() * 1.15 + 4


@pytest.mark.parametrize("side", [3, 5, 7])
def test_cells_are_closed_as_by_a_square(side):
    cells = np.random.default_rng(side).random((40, 25)) < 0.2
    square = np.ones((side, side))
    np.testing.assert_array_equal(_closed(cells, side), ndimage.binary_closing(cells, square))


def test_a_body_keeps_its_radius_from_a_box():
    grid = _grid(_room(((1.8, 1.8, 0.0), (2.2, 2.2, 1.0))))
    for x, y, free in [(2.0, 1.5, True), (2.0, 1.62, False), (2.0, 2.0, False), (1.0, 1.0, True)]:
        assert grid.free[grid.cell_at(x, y)] == free


def test_low_and_high_objects_do_not_block():
    low = _grid(_room(((1.8, 1.8, 0.0), (2.2, 2.2, 0.05))))
    high = _grid(_room(((1.8, 1.8, 1.25), (2.2, 2.2, 1.4))))
    inside = _grid(_room(((1.8, 1.8, 1.0), (2.2, 2.2, 1.4))))
    assert low.free[low.cell_at(2.0, 2.0)]
    assert high.free[high.cell_at(2.0, 2.0)]
    assert not inside.free[inside.cell_at(2.0, 2.0)]


def test_the_edge_of_the_floor_and_steps_down_are_drops():
    grid = _grid(_room())
    assert not grid.free[grid.cell_at(0.1, 2.0)]
    assert not grid.free[grid.cell_at(4.2, 2.0)]
    stairs = np.concatenate([_room(), _box((4.0, 0, -0.5), (8.0, 4.0, -0.2))])
    grid = _grid(stairs)
    cell = grid.cell_at(4.5, 2.0)
    assert not grid.contains(*cell) or not grid.free[cell]


def test_a_narrow_gap_between_floors_is_rolled_over_and_a_wide_one_is_not():
    for gap, passable in ((0.1, True), (0.5, False)):
        floors = [
            _box((0, 0, -0.1), (2.0, 4.0, 0.0)),
            _box((2.0 + gap, 0, -0.1), (4.0, 4.0, 0.0)),
        ]
        grid = _grid(np.concatenate(floors))
        regions = {int(grid.region[grid.cell_at(x, 2.0)]) for x in (1.0, 3.2)}
        assert (len(regions) == 1) == passable


def test_a_wall_without_door_parts_the_floor_in_two_regions():
    wall = ((1.95, 0.0, 0.0), (2.05, 4.0, 2.5))
    grid = _grid(_room(wall))
    assert grid.region[grid.cell_at(1, 2)] != grid.region[grid.cell_at(3, 2)]
    door = [((1.95, 0.0, 0.0), (2.05, 1.6, 2.5)), ((1.95, 2.5, 0.0), (2.05, 4.0, 2.5))]
    grid = _grid(_room(*door))
    assert grid.region[grid.cell_at(1, 2)] == grid.region[grid.cell_at(3, 2)] > 0


def test_the_nearest_free_cell_is_near_or_none():
    grid = _grid(_room(((1.8, 1.8, 0.0), (2.2, 2.2, 1.0))))
    cell = grid.nearest_free(2.0, 1.65, 0.3)
    assert cell is not None
    assert np.hypot(*(np.array(grid.point_at(*cell)) - (2.0, 1.65))) < 0.15
    assert grid.nearest_free(2.0, 2.0, 0.2) is None
    assert grid.nearest_free(50.0, -50.0) is None


def test_no_floor_and_absurd_size_are_refused():
    with pytest.raises(SceneError, match="no floor"):
        _grid(_box((0, 0, 3.0), (1, 1, 4.0)))
    wings = [_box((0, 0, -0.1), (80.0, 12.0, 0.0)), _box((0, 0, -0.1), (12.0, 60.0, 0.0))]
    hospital = FloorCells.under(np.concatenate(wings), 0.06, FINE_CELL_M)
    assert hospital.shape == (3224, 2424), "80 m by 60 m are not absurd"
    with pytest.raises(SceneError, match="too large"):
        _grid(_box((0, 0, -0.1), (9000.0, 9000.0, 0.0)))


@pytest.mark.skipif(not SCENES.is_dir(), reason="the shared scenes are not beside the repository")
@pytest.mark.parametrize("name", ["procthor_d02", "sh3d_2bedroom_apartment", "aws_bookstore"])
@pytest.mark.parametrize("radius", [0.18, 0.25])
def test_reachable_floor_agrees_with_the_scenes(name, radius):
    scene = load_scene(SCENES / name)
    stated = json.loads((SCENES / name / "scene.json").read_text())["reachable_m2"]
    grid = navigation_grid(scene, radius_m=radius, height_m=1.4, max_step_m=0.1)
    regions = {int(grid.region[grid.cell_at(p.x, p.y)]) for p in scene.start_poses} - {0}
    reached = np.isin(grid.region, list(regions))
    covered = ndimage.distance_transform_edt(~reached) * grid.cell_m <= radius
    area = covered.sum() * grid.cell_m**2
    assert area == pytest.approx(stated[f"radius_{radius}"], rel=0.02)


@pytest.mark.skipif(not SCENES.is_dir(), reason="the shared scenes are not beside the repository")
@pytest.mark.parametrize("name", ["sh3d_1bedroom_roundwall", "sh3d_4bedroom_house", "sh3d_studio"])
def test_the_starts_of_a_scene_lie_in_one_area_as_it_states(name):
    scene = load_scene(SCENES / name)
    robot = dataclasses.replace(ZED, max_step_m=0.1)
    grid = robot_grid(scene, robot)
    regions = {int(grid.region[grid.cell_at(p.x, p.y)]) for p in scene.start_poses}
    assert len(regions) == 1
    assert regions != {0}


def test_the_grid_of_a_robot_uses_its_body(furnished):
    grid = robot_grid(furnished, ZED)
    assert (grid.clearance_m[grid.free] > ZED.radius_m).all()
