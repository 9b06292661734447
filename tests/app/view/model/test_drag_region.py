"""A rectangle over the picture becomes a region of the floor."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.view.model.drag_region import brush_strokes, floor_region

DOWN = SimpleNamespace(
    position=(2.0, 3.0, 4.0), wxyz=(0.0, 1.0, 0.0, 0.0), fov=0.5 * np.pi, aspect=1.5
)
"""Looks straight down; the picture's right is the world's x, its upper side the world's y."""


def test_corners_lie_where_their_rays_meet_the_floor():
    corners = floor_region(DOWN, (0.5, 0.25), (0.75, 0.5), 0.0)
    assert corners == pytest.approx(np.array([[2, 5], [5, 5], [5, 3], [2, 3]]))


def test_a_rectangle_that_reaches_the_sky_is_refused():
    level = SimpleNamespace(
        position=(0.0, 0.0, 1.0), wxyz=(0.5, -0.5, 0.5, -0.5), fov=1.0, aspect=1.0
    )
    with pytest.raises(ValueError, match="not on the floor"):
        floor_region(level, (0.4, 0.4), (0.6, 0.6), 0.0)


@pytest.mark.parametrize("turned", [1, -1])
@pytest.mark.parametrize("size", [0.4, 3.0, 30.0])
def test_dabs_cover_the_region_and_little_else(size, turned):
    corners = np.array([[0.0, 0.0], [size, 0.2 * size], [size, size], [0.0, 0.7 * size]])[::turned]
    dabs, radius = brush_strokes(corners)
    assert len(dabs) <= 500, "a request holds no more"
    rng = np.random.default_rng(1)
    middle = corners.mean(axis=0)
    weights = rng.dirichlet(np.ones(4), 500)
    inside = middle + 0.9 * (weights @ corners - middle)
    apart = np.linalg.norm(inside[:, None] - np.array(dabs)[None], axis=2).min(axis=1)
    assert (apart <= radius + 1e-9).mean() > 0.97
    beyond = np.linalg.norm(np.array(dabs) - middle, axis=1).max()
    assert beyond <= np.linalg.norm(corners - middle, axis=1).max()


def test_a_mere_touch_is_one_dab():
    dabs, radius = brush_strokes(np.full((4, 2), 1.5))
    assert dabs == [(1.5, 1.5)]
    assert 0.1 <= radius < 0.2
