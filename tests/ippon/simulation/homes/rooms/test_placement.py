import math

import numpy as np
import pytest

from ippon.simulation.homes.furniture.mesh_builder import MeshBuilder
from ippon.simulation.homes.furniture.model import make_model
from ippon.simulation.homes.layout.rect import Rect
from ippon.simulation.homes.rooms.placement import RoomSpace, WallSpan, footprint


def _box(width, depth, height=0.5):
    b = MeshBuilder().box((-width / 2, 0.0, 0.0), (width / 2, depth, height), (9, 9, 9))
    return make_model("table", "table", b)


def _space():
    return RoomSpace(room=0, kind="study", floor=Rect(1.0, 2.0, 5.0, 5.0), ceiling_m=2.6)


@pytest.mark.parametrize("side", range(4))
def test_a_thing_at_a_wall_has_its_back_there_and_its_front_in_the_room(side):
    space = _space()
    model = _box(1.2, 0.4)
    u = space.positions(side, 1.2, 0.4, 0.5, 0.6, 0.0)[3]
    placed = space.stand_at_wall(model, side, u, clearance=0.6, gap=0.0, optional=True)
    expected = space.rect_at_wall(side, u, 1.2, 0.4)
    assert space.floor.contains(placed.rect)
    for name in ("x0", "y0", "x1", "y1"):
        assert getattr(placed.rect, name) == pytest.approx(getattr(expected, name))
    front = placed.to_world(0.0, 0.8)
    assert space.floor.grown(-0.3).contains(Rect(*front, *front))
    walls = (placed.rect.y0 - 2.0, 5.0 - placed.rect.x1, 5.0 - placed.rect.y1, placed.rect.x0 - 1.0)
    assert walls[side] == pytest.approx(0.0, abs=1e-9)


def test_nothing_is_placed_on_things_before_doors_or_at_taken_walls():
    space = _space()
    space.take(Rect(1.0, 2.0, 2.0, 2.5), Rect(1.0, 2.5, 2.0, 3.0))
    space.spans.append(WallSpan(side=0, low=3.0, high=3.8, z0=0.9, z1=2.1))
    for u in space.positions(0, 0.6, 0.4, 0.5, 0.5, 0.0):
        assert u - 0.3 >= 2.0 - 1e-9
    tall = space.positions(0, 0.6, 0.4, 1.5, 0.5, 0.0)
    assert all(u + 0.3 <= 3.0 + 1e-9 or u - 0.3 >= 3.8 - 1e-9 for u in tall)
    assert not space.is_free(Rect(1.2, 2.6, 1.4, 2.8))
    assert space.is_free(Rect(1.2, 2.6, 1.4, 2.8), ignore_clear=True)
    assert not space.is_free(Rect(4.8, 4.8, 5.2, 5.2))


def test_furniture_too_large_for_a_room_fits_nowhere():
    space = _space()
    assert space.positions(0, 4.5, 0.4, 0.5, 0.0, 0.0) == []
    assert space.positions(0, 1.0, 2.8, 0.5, 0.5, 0.0) == []
    assert space.free_spots(4.5, 1.0, 0.0) == []


def test_free_spots_are_free():
    space = _space()
    space.take(Rect(2.5, 3.0, 3.5, 4.0))
    spots = space.free_spots(1.0, 0.8, 0.1)
    assert spots
    assert all(space.is_free(Rect(x - 0.5, y - 0.4, x + 0.5, y + 0.4)) for x, y in spots)


def test_the_footprint_turns_with_the_model():
    rect = footprint(_box(1.2, 0.4), 3.0, 3.0, math.pi / 2)
    np.testing.assert_allclose(
        (rect.x0, rect.y0, rect.x1, rect.y1), (2.6, 2.4, 3.0, 3.6), atol=1e-12
    )
