import numpy as np
import pytest

from ippon.simulation.homes.layout.building_floor import BUILDING_KINDS, plan_building


@pytest.mark.parametrize("kind", BUILDING_KINDS)
@pytest.mark.parametrize("seed", range(10))
def test_rooms_fill_the_outline_without_overlap(kind, seed):
    rooms = plan_building(np.random.default_rng(seed), kind)
    area = sum(room.rect.area for room in rooms)
    assert 600.0 < area < 1250.0
    width = max(room.rect.x1 for room in rooms)
    depth = max(room.rect.y1 for room in rooms)
    assert area == pytest.approx(width * depth)
    for n, a in enumerate(rooms):
        assert min(a.rect.width, a.rect.depth) >= 1.75, a
        assert not any(a.rect.overlaps(b.rect) for b in rooms[n + 1 :])


@pytest.mark.parametrize(
    ("kind", "room", "count"), [("office", "office", 8), ("ward", "patient_room", 6)]
)
def test_like_rooms_of_one_size_lie_in_a_row(kind, room, count):
    rects = [r.rect for r in plan_building(np.random.default_rng(3), kind) if r.kind == room]
    at_line = max(
        ([r for r in rects if getattr(r, side) == getattr(first, side)] for first in rects
         for side in ("x0", "y0")),
        key=len,
    )  # fmt: skip
    assert len(at_line) >= count
    assert np.ptp([r.area for r in at_line]) < 1.5
