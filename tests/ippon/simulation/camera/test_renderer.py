import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.geometry import base_pose, transform_points
from ippon.robot import ZED
from ippon.simulation.camera.renderer import SceneRenderer
from ippon.simulation.scene_reader import load_scene

T_WORLD_CAMERA = base_pose(1.0, 1.5, 0.0, 0.2) @ ZED.T_base_camera(-0.3)


def test_depth_lifts_to_points_on_the_instance_that_is_seen(furnished, camera):
    picture = SceneRenderer(furnished).render(camera, T_WORLD_CAMERA)
    assert picture.color.dtype == np.uint8
    assert picture.depth.dtype == np.float32
    assert picture.instance.dtype == np.int32
    points = transform_points(T_WORLD_CAMERA, camera.back_project(picture.depth).astype(float))
    low = np.array([i.aabb_min for i in furnished.instances])[picture.instance.ravel()]
    high = np.array([i.aabb_max for i in furnished.instances])[picture.instance.ravel()]
    assert (points >= low - 1e-4).all()
    assert (points <= high + 1e-4).all()
    seen = {furnished.instances[k].label for k in np.unique(picture.instance)}
    assert {"floor", "wall", "coffee table", "hat", "armchair"} <= seen


def test_nothing_beyond_the_range_has_a_depth(furnished, camera):
    renderer = SceneRenderer(furnished)
    full = renderer.render(camera, T_WORLD_CAMERA)
    near = renderer.render(camera, T_WORLD_CAMERA, max_depth_m=2.0)
    np.testing.assert_array_equal(near.depth, np.where(full.depth <= 2.0, full.depth, 0.0))
    np.testing.assert_array_equal(near.instance, full.instance)
    assert (near.depth == 0.0).any()


def test_an_empty_direction_reads_nothing(make_scene, camera):
    scene = make_scene([("table", "table", (-2.0, 0.0, 0.0), (-1.0, 1.0, 1.0))])
    picture = SceneRenderer(scene).render(camera, T_WORLD_CAMERA)
    assert (picture.depth == 0.0).all()
    assert (picture.instance == -1).all()


def test_pictures_do_not_depend_on_the_pictures_before(furnished, camera):
    renderer = SceneRenderer(furnished)
    first = renderer.render(camera, T_WORLD_CAMERA)
    renderer.render(camera, base_pose(2.0, 2.0, 0.0, 3.0) @ ZED.T_base_camera(0.2))
    again = renderer.render(camera, T_WORLD_CAMERA)
    fresh = SceneRenderer(furnished).render(camera, T_WORLD_CAMERA)
    for other in (again, fresh):
        np.testing.assert_array_equal(first.color, other.color)
        np.testing.assert_array_equal(first.depth, other.depth)
        np.testing.assert_array_equal(first.instance, other.instance)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["procthor_d03", "aws_small_house", "sh3d_studio"])
def test_homes_look_as_an_independent_ray_caster_sees_them(name, scenes_folder):
    o3d = pytest.importorskip("open3d")
    scene = load_scene(scenes_folder / name)
    caster = o3d.t.geometry.RaycastingScene(nthreads=1)
    caster.add_triangles(scene.vertices, scene.faces.astype(np.uint32))
    camera = PinholeCamera.from_horizontal_fov(160, 100, np.radians(74.0))
    renderer = SceneRenderer(scene)
    for k, start in enumerate(scene.start_poses[:6]):
        T = base_pose(start.x, start.y, start.z, start.yaw + k) @ ZED.T_base_camera(0.1 * k - 0.5)
        picture = renderer.render(camera, T)
        rays = np.empty((camera.height, camera.width, 6), dtype=np.float32)
        rays[..., :3] = T[:3, 3]
        rays[..., 3:] = camera.rays() @ T[:3, :3].T
        hits = caster.cast_rays(o3d.core.Tensor.from_numpy(rays), nthreads=1)
        expected = hits["t_hit"].numpy()
        depth = np.where(picture.depth > 0.0, picture.depth, np.inf)
        same_depth = np.isclose(depth, expected, rtol=1e-4) | (np.isinf(depth) & np.isinf(expected))
        # Rays through an edge may pick either side of it.
        assert same_depth.mean() > 0.999
        face = hits["primitive_ids"].numpy().astype(np.int64)
        known = np.isfinite(expected)
        owner = scene.face_instance[np.where(known, face, 0)]
        # Where two walls share a plane, either may be seen.
        category = np.array([instance.category for instance in scene.instances])
        assert (category[owner] == category[picture.instance])[known].mean() > 0.998
