import numpy as np
import pytest

from ippon.robot import CollisionSphere, upright_body
from ippon.simulation.robot.contact import BodyContacts, closest_point_kernel
from tests.reference import contact as reference


@pytest.mark.parametrize("seed", range(5))
def test_the_closest_point_is_the_best_of_plane_and_edges(seed):
    rng = np.random.default_rng(seed)
    out = np.empty(3)
    for _ in range(300):
        triangle, point = rng.normal(size=(3, 3)), rng.normal(size=3) * 2.0
        closest_point_kernel(triangle, *point, out)
        np.testing.assert_allclose(out, reference.closest_point(triangle, point), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_penetration_is_that_of_every_sphere_against_every_triangle(seed, furnished):
    rng = np.random.default_rng(seed)
    spheres = (
        CollisionSphere(x_m=0.2, y_m=0.1, z_m=0.4, radius_m=0.22),
        CollisionSphere(x_m=-0.25, y_m=0.0, z_m=0.3, radius_m=0.15),
    )
    contacts = BodyContacts(furnished, spheres, 0.0)
    triangles = furnished.vertices[furnished.faces].astype(float)
    touching = 0
    for x, y, yaw in rng.uniform((0.1, 0.1, -3.1), (4.9, 3.9, 3.1), (60, 3)):
        c, s = np.cos(yaw), np.sin(yaw)
        world = np.array(
            [
                (x + c * b.x_m - s * b.y_m, y + s * b.x_m + c * b.y_m, b.z_m, b.radius_m)
                for b in spheres
            ]
        )
        depth, _ = reference.deepest(triangles, world)
        found = contacts.deepest(x, y, yaw)
        assert found.depth_m == pytest.approx(depth, abs=1e-9)
        touching += depth > 0.0
    assert 5 < touching < 55


def test_a_wall_pushes_straight_back(make_scene, room_boxes):
    contacts = BodyContacts(make_scene(room_boxes()), upright_body(0.25, 1.2, 0.06), 0.0)
    found = contacts.deepest(0.2, 2.0, 0.0)
    assert found.depth_m == pytest.approx(0.05, abs=1e-6)
    assert (found.normal_x, found.normal_y) == pytest.approx((1.0, 0.0), abs=1e-6)
    assert contacts.deepest(0.26, 2.0, 0.0).depth_m == 0.0


def test_the_body_passes_over_and_under_obstacles_outside_its_height(make_scene, room_boxes):
    body = upright_body(0.25, 1.2, 0.06)
    rug = ("objects", "rug", (1.0, 1.0, 0.0), (2.0, 2.0, 0.04))
    shelf = ("shelving", "shelf", (1.0, 2.5, 1.3), (2.0, 3.5, 1.4))
    bar = ("table", "bar", (3.0, 1.0, 1.0), (4.0, 2.0, 1.1))
    contacts = BodyContacts(make_scene([*room_boxes(), rug, shelf, bar]), body, 0.0)
    assert contacts.deepest(1.5, 1.5, 0.0).depth_m == 0.0
    assert contacts.deepest(1.5, 3.0, 0.0).depth_m == 0.0
    assert contacts.deepest(3.5, 1.5, 0.0).depth_m > 0.0


def test_a_scene_with_nothing_at_the_bodys_height_touches_nothing(make_scene):
    floor = make_scene([("floor", "floor", (0.0, 0.0, -0.1), (3.0, 3.0, 0.0))])
    contacts = BodyContacts(floor, upright_body(0.25, 1.2, 0.06), 0.0)
    assert contacts.deepest(1.5, 1.5, 0.0).depth_m == 0.0
