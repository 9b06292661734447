import numpy as np
import pytest

from ippon.simulation.homes.layout.openings import exterior_openings, join_rooms, shared_walls
from ippon.simulation.homes.layout.room_layout import plan_rooms


def _joined(seed):
    rng = np.random.default_rng(seed)
    for _ in range(60):
        rooms = plan_rooms(rng)
        walls = shared_walls(rooms)
        doors = join_rooms(rng, rooms, walls)
        if doors is not None:
            return rng, rooms, walls, doors
    raise AssertionError(f"no arrangement for seed {seed}")


@pytest.mark.parametrize("seed", range(60))
def test_rooms_do_not_overlap_and_have_the_size_of_rooms(seed):
    rooms = plan_rooms(np.random.default_rng(seed))
    assert 1 <= len(rooms) <= 9
    assert 30.0 <= sum(r.rect.area for r in rooms) <= 250.0
    assert min(min(r.rect.x0, r.rect.y0) for r in rooms) == 0.0
    for n, a in enumerate(rooms):
        assert min(a.rect.width, a.rect.depth) >= 1.3
        assert not any(a.rect.overlaps(b.rect) for b in rooms[n + 1 :])


@pytest.mark.parametrize("seed", range(40))
def test_walls_cover_every_side_of_every_room_once(seed):
    rooms = plan_rooms(np.random.default_rng(seed))
    walls = shared_walls(rooms)
    length = dict.fromkeys(range(len(rooms)), 0.0)
    for w in walls:
        for k in {w.first, w.second} - {-1}:
            length[k] += w.high - w.low
    for k, room in enumerate(rooms):
        assert length[k] == pytest.approx(2 * (room.rect.width + room.rect.depth))


@pytest.mark.parametrize("seed", range(40))
def test_doors_join_all_rooms_and_bathrooms_are_not_passages(seed):
    _, rooms, _, doors = _joined(seed)
    reached = {0}
    for _ in rooms:
        for d in doors:
            if reached & set(d.rooms):
                reached |= set(d.rooms)
    assert reached == set(range(len(rooms)))
    for k, room in enumerate(rooms):
        if room.kind in ("bathroom", "laundry"):
            assert sum(k in d.rooms for d in doors) == 1


@pytest.mark.parametrize("seed", range(40))
def test_openings_lie_within_their_walls_and_apart_from_one_another(seed):
    rng, rooms, walls, doors = _joined(seed)
    openings = [*doors, *exterior_openings(rng, rooms, walls)]
    for o in openings:
        assert o.low < o.high
        assert 0.0 <= o.z0 < o.z1 < 2.5
        if o.kind in ("door", "passage"):
            assert o.width >= 0.85
        assert any(
            w.along_x == o.along_x and w.line == o.line and w.low < o.low and o.high < w.high
            for w in walls
        ), o
    for n, a in enumerate(openings):
        for b in openings[n + 1 :]:
            if (a.along_x, a.line) == (b.along_x, b.line):
                assert a.high < b.low or b.high < a.low


def test_every_home_has_a_front_door_and_windows():
    for seed in range(40):
        rng, rooms, walls, _ = _joined(seed)
        kinds = [o.kind for o in exterior_openings(rng, rooms, walls)]
        assert kinds.count("front_door") == 1
        assert "window" in kinds
