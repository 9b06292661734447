"""The floor under a robot whose pose varies, and on the way to another floor."""

import pytest

from app.view.floor_height import FloorHeight, layer_below

TENTH_NS = 100_000_000


def _floors(heights_m):
    """Return the floor after each pose of 10 Hz."""
    floor, floors = FloorHeight(), []
    for n, z in enumerate(heights_m):
        before = floor.z_m
        changed = floor.stand_on(z, n * TENTH_NS)
        assert changed == (floor.z_m != before)
        floors.append(floor.z_m)
    return floors


@pytest.mark.parametrize("z", [3.0, -1.3])
def test_the_first_pose_is_on_the_floor(z):
    assert FloorHeight().z_m == 0.0
    assert _floors([z]) == [z]


def test_a_pose_that_varies_is_on_the_same_floor():
    assert set(_floors([0.0, *[0.18, -0.18] * 20])) == {0.0}


@pytest.mark.parametrize("speed_m_s", [0.3, 1.0, 100.0])
def test_a_lift_leads_from_floor_to_floor_and_to_none_between(speed_m_s):
    up = [min(0.1 * speed_m_s * n, 3.0) for n in range(130)]
    floors = _floors(up)
    assert sorted(set(floors)) == [0.0, 3.0]
    assert floors[-1] == 3.0


def test_a_slope_is_followed_in_steps():
    floors = _floors([0.005 * n for n in range(400)])
    assert abs(floors[-1] - 2.0) < 0.25
    assert len(set(floors)) < 12


def test_a_clock_that_was_set_back_stops_no_floor():
    floor = FloorHeight()
    floor.stand_on(0.0, 100 * TENTH_NS)
    for n in range(12):
        floor.stand_on(3.0, n * TENTH_NS)
    assert floor.z_m == 3.0


@pytest.mark.parametrize(("floor_z_m", "layer"), [(0.0, 14), (3.0, 44), (-1.3, 1)])
def test_the_cut_is_above_the_floor(floor_z_m, layer):
    assert layer_below(1.4, floor_z_m, 0.1) == layer


def test_a_map_that_begins_near_zero_has_its_floor_there():
    assert set(_floors([-0.06] * 30)) == {0.0}
