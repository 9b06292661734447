import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.geometry import base_pose, invert_transform
from ippon.robot import ZED
from ippon.simulation.camera.raster import image_boxes, rasterise, visible_instances
from tests.reference.rasterisation import first_hits


def projection_of(camera, T_world_camera):
    intrinsics = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
    return intrinsics @ invert_transform(T_world_camera)[:3]


def draw(camera, T_world_camera, vertices, faces, ranges=None):
    if ranges is None:
        ranges = np.array([[0, len(vertices), 0, len(faces)]], dtype=np.int32)
    projection = projection_of(camera, T_world_camera)
    inverse_depth = np.empty((camera.height, camera.width), dtype=np.float32)
    face = np.empty((camera.height, camera.width), dtype=np.int32)
    low = np.array([vertices[a:b].min(axis=0) for a, b, _, _ in ranges], dtype=float)
    high = np.array([vertices[a:b].max(axis=0) for a, b, _, _ in ranges], dtype=float)
    boxes = image_boxes(projection, camera.width, camera.height, low, high)
    rasterise(projection, vertices, faces, ranges, boxes, inverse_depth, face)
    return inverse_depth, face


def disagreements(camera, T_world_camera, vertices, faces, ranges=None):
    """Share of pixels whose depth is not that of casting every ray at every triangle."""
    inverse_depth, _ = draw(camera, T_world_camera, vertices, faces, ranges)
    rays = camera.rays().reshape(-1, 3) @ T_world_camera[:3, :3].T
    expected, _ = first_hits(rays, T_world_camera[:3, 3], vertices[faces].astype(float))
    with np.errstate(divide="ignore"):
        got = 1.0 / inverse_depth.ravel().astype(float)
    both_empty = np.isinf(got) & np.isinf(expected)
    with np.errstate(invalid="ignore"):
        same = both_empty | (np.abs(got - expected) <= 1e-5 * expected)
    return 1.0 - same.mean()


@pytest.mark.parametrize("seed", range(8))
def test_a_soup_of_triangles_looks_as_rays_say(seed):
    rng = np.random.default_rng(seed)
    camera = PinholeCamera.from_horizontal_fov(70, 45, 1.2)
    centres = rng.uniform(-3.0, 3.0, (60, 1, 3))
    vertices = (centres + rng.normal(0.0, 1.0, (60, 3, 3))).reshape(-1, 3).astype(np.float32)
    faces = np.arange(180, dtype=np.int32).reshape(-1, 3)
    # The camera stands amid the triangles: many reach behind it or through the near plane.
    T = base_pose(*rng.uniform(-1.0, 1.0, 3), rng.uniform(-3.0, 3.0)) @ ZED.T_base_camera(-0.3)
    # Where two triangles cut each other or an edge meets a pixel exactly, rounding decides.
    assert disagreements(camera, T, vertices, faces) < 0.002


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_room_has_no_cracks_between_its_triangles(seed, make_scene, room_boxes):
    rng = np.random.default_rng(seed)
    scene = make_scene(room_boxes())
    camera = PinholeCamera.from_horizontal_fov(320, 200, 1.3)
    x, y, yaw = rng.uniform(0.3, 3.7), rng.uniform(0.3, 3.7), rng.uniform(-3.0, 3.0)
    T = base_pose(x, y, 0.0, yaw) @ ZED.T_base_camera(rng.uniform(-1.0, 0.4))
    _, face = draw(camera, T, scene.vertices, scene.faces)
    assert (face >= 0).all()


def test_hidden_objects_change_nothing_whatever_the_order(make_scene, room_boxes):
    rng = np.random.default_rng(3)
    # A dense ball behind a wall: enough faces that it is worth asking whether it is hidden.
    directions = rng.normal(size=(600, 3))
    ball = directions / np.linalg.norm(directions, axis=1, keepdims=True) * 0.4 + (6.5, 2.0, 1.0)
    room = make_scene(room_boxes())
    vertices = np.concatenate([room.vertices, ball]).astype(np.float32)
    start, count = len(room.vertices), len(room.faces)
    faces = np.concatenate([room.faces, start + np.arange(600).reshape(-1, 3)]).astype(np.int32)
    room_range, ball_range = (0, start, 0, count), (start, start + 600, count, len(faces))
    camera = PinholeCamera.from_horizontal_fov(160, 100, 1.3)
    T = base_pose(1.0, 2.0, 0.0, 0.0) @ ZED.T_base_camera(0.0)
    orders = [np.array(order, dtype=np.int32) for order in ((room_range, ball_range),)]
    orders.append(orders[0][::-1].copy())
    first, second = (draw(camera, T, vertices, faces, order) for order in orders)
    np.testing.assert_array_equal(first[0], second[0])
    assert (first[1] < count).all()
    # Seen from the other side of the wall the ball is there.
    T = base_pose(8.5, 2.0, 0.0, np.pi) @ ZED.T_base_camera(0.0)
    _, face = draw(camera, T, vertices, faces, orders[0])
    assert (face >= count).sum() > 200


def test_boxes_in_view_are_never_called_out_of_view():
    rng = np.random.default_rng(0)
    camera = PinholeCamera.from_horizontal_fov(80, 50, 1.2)
    T = base_pose(0.0, 0.0, 0.0, 0.4) @ ZED.T_base_camera(-0.2)
    projection = projection_of(camera, T)
    centre, half = rng.uniform(-4.0, 4.0, (400, 3)), rng.uniform(0.05, 0.8, (400, 3))
    low, high = centre - half, centre + half
    called_visible = visible_instances(projection, 80, 50, low, high)
    points = rng.uniform(low, high, (500, 400, 3)) @ projection[:, :3].T + projection[:, 3]
    z = points[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = points[..., 0] / z, points[..., 1] / z
    seen = ((z > 0.01) & (u > -0.5) & (u < 79.5) & (v > -0.5) & (v < 49.5)).any(axis=0)
    assert not (seen & ~called_visible).any()
    # And the test is worth something: most boxes elsewhere are dropped.
    assert (~called_visible).sum() > 0.8 * (~seen).sum()
    boxes = image_boxes(projection, 80, 50, low, high)
    inside = (z > 0.01) & (u >= 0) & (u <= 79) & (v >= 0) & (v <= 49)
    within = (u >= boxes[:, 0]) & (u <= boxes[:, 1]) & (v >= boxes[:, 2]) & (v <= boxes[:, 3])
    assert (within | ~inside).all()
    assert (1.0 / z[inside] <= np.broadcast_to(boxes[:, 4], z.shape)[inside] + 1e-9).all()
