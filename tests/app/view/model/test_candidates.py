"""The places that a search without a find ends with."""

import numpy as np
import pytest

from app.view.model.candidates import APART_M, LISTED, best_candidates
from app.view.model.picture_store import PictureStore
from app.view.model.voxel_store import VoxelStore, VoxelUpdate
from ippon.camera import PinholeCamera
from ippon.geometry import make_transform

CAMERA = PinholeCamera.from_horizontal_fov(400, 250, 1.29)
AHEAD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Rotation of a camera that looks along the world's x."""
SIZE = 0.1


def _store(places, label=2):
    """A store with single voxels, {(i, j, k): stored probability}."""
    attributes = np.zeros((len(places), 8), np.uint8)
    attributes[:, 3], attributes[:, 6] = list(places.values()), label
    store = VoxelStore()
    store.apply(
        VoxelUpdate(
            indices=np.array(list(places), np.int64),
            attributes=attributes,
            surface=np.ones(len(places), bool),
        )
    )
    return store


def _album(*eyes):
    pictures = PictureStore()
    for n, eye in enumerate(eyes):
        pictures.add(n, b"picture", CAMERA, make_transform(AHEAD, np.array(eye)))
    return pictures


def test_the_likeliest_places_come_first_and_neighbours_are_one_place():
    places = {(20, 0, 5): 120, (21, 0, 5): 200, (40, 0, 5): 150, (-60, 9, 5): 90, (0, 80, 5): 80}
    found = best_candidates(_store(places), SIZE, PictureStore())
    assert [round(c.probability * 254) for c in found] == [200, 150, 90]
    assert found[0].point_world == pytest.approx((2.15, 0.05, 0.55))
    assert found[2].point_world == pytest.approx((-5.95, 0.95, 0.55))
    assert {c.label for c in found} == {2}
    assert len(found) == LISTED
    assert APART_M < 1.9


def test_what_looks_like_nothing_is_not_listed():
    assert best_candidates(_store({(1, 1, 1): 12, (30, 1, 1): 255}), SIZE, PictureStore()) == ()
    assert best_candidates(VoxelStore(), SIZE, PictureStore()) == ()


def test_the_middle_of_equal_voxels_stands_for_them():
    found = best_candidates(_store({(i, 0, 0): 99 for i in range(7)}), SIZE, PictureStore())
    assert found[0].point_world[0] == pytest.approx(0.35)


def test_the_closest_picture_that_sees_it_is_named():
    store = _store({(20, 0, 5): 200})
    near = best_candidates(store, SIZE, _album((-1.0, 0.0, 0.5), (0.0, 0.0, 0.5)))[0].picture
    assert near.picture.stamp_ns == 1
    assert near.depth_m == pytest.approx(2.05)
    assert abs(near.u - 200) < 12
    behind = best_candidates(store, SIZE, _album((4.0, 0.0, 0.5)))[0]
    assert behind.picture is None


def test_a_picture_with_something_in_between_does_not_show_it():
    store = _store({(20, 0, 5): 200} | {(10, j, k): 1 for j in range(-6, 7) for k in range(12)})
    assert best_candidates(store, SIZE, _album((0.0, 0.05, 0.55)))[0].picture is None
