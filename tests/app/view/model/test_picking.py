"""A click finds the floor, the nearest bead, the first surface; a camera sees what is unhidden."""

import numpy as np
import pytest

from app.view.drawing.derived_layers import clearance_slice, skin
from app.view.model.picking import (
    SurfaceLookup,
    first_voxel,
    floor_point,
    is_hidden,
    nearest_viewpoint,
    seen_from,
)
from app.view.model.voxel_store import VoxelStore, VoxelUpdate

DOWN = np.array([0.0, 0.0, -1.0])
V = 0.1


def store_of(indices) -> VoxelStore:
    store = VoxelStore()
    n = len(indices)
    store.apply(
        VoxelUpdate(
            indices=np.array(indices, dtype=np.int64),
            attributes=np.full((n, 8), 7, np.uint8),
            surface=np.ones(n, bool),
        )
    )
    return store


def wall(x: int) -> list[tuple[int, int, int]]:
    return [(x, j, k) for j in range(-20, 20) for k in range(-20, 20)]


def test_the_floor_is_where_the_ray_meets_it():
    slanted = np.array([1.0, 0.0, -1.0])
    point = floor_point(np.array([0.0, 2.0, 3.0]), slanted, 0.5)
    assert point == pytest.approx([2.5, 2.0, 0.5])
    for direction in (np.array([1.0, 0.0, 0.2]), np.array([1.0, 0.0, -1e-3])):
        with pytest.raises(ValueError, match="not on the floor; tilt the view down"):
            floor_point(np.array([0.0, 0.0, 3.0]), direction, 0.0)


def test_a_click_beside_a_bead_means_the_bead_and_far_from_it_none():
    beads = np.array([[0.0, 0.0, 0.3], [1.0, 0.0, 0.3]])
    hit = nearest_viewpoint(np.array([0.95, 0.05, 3.0]), DOWN, beads)
    assert hit is not None
    assert hit[0] == 1
    assert hit[1] == pytest.approx(2.7)
    assert nearest_viewpoint(np.array([0.5, 0.0, 3.0]), DOWN, beads) is None
    assert nearest_viewpoint(np.array([1.0, 0.0, 0.0]), DOWN, beads) is None, "behind the eye"
    assert nearest_viewpoint(np.zeros(3), DOWN, np.empty((0, 3))) is None


def test_the_first_surface_on_the_ray_hides_what_is_behind_it():
    lookup = SurfaceLookup(store_of(wall(10) + wall(20)), None)
    hit = first_voxel(np.array([0.05, 0.05, 0.05]), np.array([2.0, 0.0, 0.0]), V, lookup)
    assert hit is not None
    assert hit[0] == (10, 0, 0)
    assert hit[1] == pytest.approx(0.95, abs=0.05)
    assert lookup.attributes((10, 0, 0)) is not None
    assert first_voxel(np.zeros(3), np.array([-1.0, 0.0, 0.0]), V, lookup) is None


def test_what_the_ceiling_cut_hides_cannot_be_clicked():
    lookup = SurfaceLookup(store_of([(0, 0, 30), (0, 0, -1)]), 14)
    hit = first_voxel(np.array([0.05, 0.05, 5.0]), DOWN, V, lookup)
    assert hit is not None
    assert hit[0] == (0, 0, -1)


def test_a_camera_sees_the_near_wall_and_not_the_far_one():
    T = np.eye(4)
    T[:3, :3] = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    seen = seen_from(store_of(wall(10) + wall(20)), V, T, (0.5, 0.5), 5.0)
    assert len(seen)
    assert seen[:, 0] == pytest.approx(1.05)
    assert np.abs(seen[:, 1]).max() <= 0.5 * 1.05 + V
    assert len(seen_from(store_of(wall(80)), V, T, (0.5, 0.5), 5.0)) == 0, "out of reach"


def test_the_skin_of_two_voxels_that_touch_has_ten_faces():
    vertices, faces = skin(np.array([[0, 0, 0], [1, 0, 0]]), V)
    assert vertices.shape == (40, 3)
    assert faces.shape == (20, 3)
    normals = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    middle = vertices[faces].mean(axis=1) - np.array([0.1, 0.05, 0.05])
    assert (np.einsum("ij,ij->i", normals, middle) > 0.0).all(), "faces look outwards"


@pytest.mark.parametrize("layers", [0, 30, -13])
def test_clearance_is_the_distance_to_what_stands_at_the_height_of_the_body(layers):
    floor = [(i, j, -1) for i in range(10) for j in range(3)]
    voxels = np.array([*floor, (0, 0, 5), (0, 1, 5), (0, 2, 5), (9, 1, 25), (9, 9, -30)])
    points, distance = clearance_slice(voxels + np.array([0, 0, layers]), V, layers * V)
    assert len(points) == 27, "the floor under the wall is taken; the lamp overhead takes nothing"
    assert points[:, 2] == pytest.approx(layers * V + 0.03, abs=1e-6)
    far = distance[np.argmax(points[:, 0])]
    assert far == pytest.approx(0.9, abs=1e-6)


@pytest.mark.parametrize(
    ("beyond", "hidden"),
    [(2.0, True), (1.25, False), (0.5, False)],
    ids=["behind the wall", "on the wall", "before it"],
)
def test_a_box_is_hidden_by_what_is_before_it(beyond, hidden):
    store = store_of(wall(12))
    origin, size = np.array([0.05, 0.05, 0.05]), np.full(3, 0.2)
    assert is_hidden(store, V, origin, np.array([beyond, 0.0, 0.1]), size) == hidden


def test_a_box_that_can_be_seen_in_part_is_not_hidden():
    store = store_of([voxel for voxel in wall(12) if voxel[1] < 0])
    origin = np.array([0.05, 0.05, 0.05])
    assert not is_hidden(store, V, origin, np.array([2.0, -0.2, 0.1]), np.full(3, 1.0))
    assert is_hidden(store, V, origin, np.array([2.0, -0.9, 0.1]), np.full(3, 0.4))
