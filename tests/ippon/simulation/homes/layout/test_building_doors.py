from itertools import combinations

import numpy as np
import pytest

from ippon.simulation.homes.layout.building_doors import join_building
from ippon.simulation.homes.layout.building_floor import BUILDING_KINDS, plan_building
from ippon.simulation.homes.layout.openings import shared_walls


def _joined(kind, seed):
    rng = np.random.default_rng(seed)
    rooms = plan_building(rng, kind)
    walls = shared_walls(rooms)
    return rooms, walls, join_building(rng, rooms, walls)


@pytest.mark.parametrize("kind", BUILDING_KINDS)
@pytest.mark.parametrize("seed", range(10))
def test_every_room_opens_to_a_corridor_and_corridors_are_joined(kind, seed):
    rooms, _, doors = _joined(kind, seed)
    reached = {next(k for k, room in enumerate(rooms) if room.kind == "hall")}
    for _ in rooms:
        for door in doors:
            if reached & set(door.rooms):
                reached |= set(door.rooms)
    assert reached == set(range(len(rooms)))
    assert all("hall" in {rooms[k].kind for k in door.rooms} for door in doors)


@pytest.mark.parametrize("kind", BUILDING_KINDS)
@pytest.mark.parametrize("seed", range(10))
def test_openings_lie_within_their_walls_and_apart(kind, seed):
    _, walls, doors = _joined(kind, seed)
    for door in doors:
        assert door.width >= 0.88
        assert any(
            (w.along_x, w.line) == (door.along_x, door.line)
            and w.low < door.low
            and door.high < w.high
            for w in walls
        ), door
    for a, b in combinations(doors, 2):
        if (a.along_x, a.line) == (b.along_x, b.line):
            assert a.high < b.low or b.high < a.low


@pytest.mark.parametrize("kind", ["office", "ward", "school"])
def test_some_doors_are_opposite_each_other(kind):
    count = 0
    for seed in range(5):
        _, _, doors = _joined(kind, seed)
        count += sum(
            a.along_x == b.along_x and 0.0 < abs(a.line - b.line) < 5.0 and a.low == b.low
            for a, b in combinations([d for d in doors if d.kind == "door"], 2)
        )
    assert count >= 10
