import numpy as np
import pytest
from scipy import ndimage

from ippon.robot import upright_body
from ippon.simulation.robot.contact import BodyContacts
from ippon.simulation.robot.floor_support import FloorSupport
from ippon.simulation.scene_reader import load_scene


def floor(low, high):
    return ("floor", "floor", (*low, -0.1), (*high, 0.0))


def test_the_floor_carries_inside_and_not_past_its_edge(make_scene):
    support = FloorSupport(make_scene([floor((0, 0), (4, 3))]), 0.0, 0.08, ring_m=0.15)
    assert support.carries(2.0, 1.5)
    assert support.carries(0.25, 0.25)
    assert not support.carries(0.05, 1.5)
    assert not support.carries(-1.0, 1.5)
    assert not support.carries(40.0, 1.5)


def test_the_gap_under_a_wall_is_bridged_but_not_a_stairwell(make_scene):
    scene = make_scene([floor((0, 0), (2, 3)), floor((2.2, 0), (4, 3)), floor((5, 0), (7, 3))])
    support = FloorSupport(scene, 0.0, 0.08, ring_m=0.15)
    assert all(support.carries(x, 1.5) for x in np.arange(0.3, 3.8, 0.02))
    assert not support.carries(4.5, 1.5)
    assert support.carries(6.0, 1.5)


def test_another_storey_does_not_carry(make_scene):
    low, high = floor((0, 0), (2, 2)), ("stairs", "step", (2.0, 0.0, 0.1), (4.0, 2.0, 0.18))
    scene = make_scene([low, high])
    assert not FloorSupport(scene, 0.0, 0.08, ring_m=0.15).carries(3.0, 1.0)
    assert FloorSupport(scene, 0.18, 0.08, ring_m=0.15).carries(3.0, 1.0)


def test_without_any_floor_nothing_carries(make_scene):
    scene = make_scene([("table", "table", (0.0, 0.0, 0.5), (1.0, 1.0, 0.6))])
    assert not FloorSupport(scene, 0.0, 0.08, ring_m=0.1).carries(0.5, 0.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "narrow_m2", "wide_m2"),
    [("procthor_d01", 74, 72), ("sh3d_1bedroom_roundwall", 30, 28), ("sh3d_studio", 14, 13)],
)
def test_reachable_floor_agrees_with_the_homes_authors(name, narrow_m2, wide_m2, scenes_folder):
    scene = load_scene(scenes_folder / name)
    cell = 0.06
    low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    xs, ys = np.arange(low[0], high[0], cell), np.arange(low[1], high[1], cell)
    start = scene.start_poses[0]
    for radius, expected in ((0.18, narrow_m2), (0.25, wide_m2)):
        contacts = BodyContacts(scene, upright_body(radius, 1.4, 0.1), start.z)
        support = FloorSupport(scene, start.z, 0.08, ring_m=0.6 * radius)
        free = np.array(
            [
                [contacts.deepest(x, y, 0.0).depth_m < 1e-4 and support.carries(x, y) for x in xs]
                for y in ys
            ]
        )
        areas, _ = ndimage.label(free, np.ones((3, 3)))
        rows = [
            (round((q.y - ys[0]) / cell), round((q.x - xs[0]) / cell)) for q in scene.start_poses
        ]
        reached = {int(areas[row]) for row in rows}
        assert len(reached) == 1
        assert 0 not in reached
        away = ndimage.distance_transform_edt(areas != reached.pop()) * cell
        assert (away <= radius).sum() * cell**2 == pytest.approx(expected, rel=0.1)
