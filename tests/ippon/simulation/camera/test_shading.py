import dataclasses

import numpy as np

from ippon.camera import PinholeCamera
from ippon.geometry import base_pose, invert_transform, transform_points
from ippon.robot import ZED
from ippon.simulation.camera.renderer import SceneRenderer

T_WORLD_CAMERA = base_pose(1.0, 1.5, 0.0, 0.2) @ ZED.T_base_camera(-0.3)


def test_face_colours_show_shaded_but_in_their_hue(make_scene, room_boxes, camera):
    scene = make_scene(room_boxes())
    colors = np.tile(np.array([200, 60, 60], dtype=np.uint8), (len(scene.faces), 1))
    scene = dataclasses.replace(scene, face_colors=colors)
    picture = SceneRenderer(scene).render(camera, T_WORLD_CAMERA).color.astype(float)
    ratio = picture[..., 0] / picture[..., 1]
    assert np.abs(ratio - 200 / 60).max() < 0.12
    # Walls that meet at a corner, and the floor, can be told apart.
    assert np.ptp(picture[..., 0]) > 15


def textured_wall(make_scene, image, repeat):
    """A wall at x = 3 whose texture repeats `repeat` times, left to right as the camera sees it."""
    scene = make_scene([("wall", "wall", (3.0, -1.0, 0.0), (3.1, 1.0, 2.0))])
    vertices = np.array([[3, 1, 0], [3, -1, 0], [3, -1, 2], [3, 1, 2]], dtype=np.float32)
    uv = np.array([[0, 0], [repeat, 0], [repeat, repeat], [0, repeat]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return dataclasses.replace(
        scene,
        vertices=vertices,
        faces=faces,
        face_instance=np.zeros(2, dtype=np.int32),
        face_colors=np.zeros((2, 3), dtype=np.uint8),
        textures=(image,),
        face_texture=np.zeros(2, dtype=np.int32),
        face_uvs=uv[faces] + np.float32(4.0),
    )


def test_textures_are_upright_unmirrored_and_repeat(make_scene):
    image = np.zeros((32, 32, 3), dtype=np.uint8)
    image[:16, :16] = (255, 0, 0)  # top left
    image[:16, 16:] = (0, 255, 0)  # top right
    image[16:, :16] = (0, 0, 255)  # bottom left
    image[16:, 16:] = (255, 255, 255)
    camera = PinholeCamera.from_horizontal_fov(200, 200, np.radians(60.0))
    T = base_pose(0.0, 0.0, 0.0, 0.0) @ ZED.T_base_camera(0.0)
    scene = textured_wall(make_scene, image, repeat=2)
    picture = SceneRenderer(scene).render(camera, T)
    to_camera = invert_transform(T)
    for y, z, expected in [
        (0.75, 1.75, (1, 0, 0)),
        (0.25, 1.75, (0, 1, 0)),
        (0.75, 1.25, (0, 0, 1)),
        (0.25, 1.25, (1, 1, 1)),
        (-0.25, 1.75, (1, 0, 0)),
        (-0.75, 0.75, (0, 1, 0)),
        (0.75, 0.25, (0, 0, 1)),
    ]:
        x_c, y_c, z_c = transform_points(to_camera, np.array([[3.0, y, z]]))[0]
        u = round(camera.fx * x_c / z_c + camera.cx)
        v = round(camera.fy * y_c / z_c + camera.cy)
        bright = picture.color[v, u] > 120
        assert tuple(bright.astype(int)) == expected, (y, z)


def test_fine_textures_fade_to_their_mean_far_away(make_scene):
    rng = np.random.default_rng(0)
    image = (rng.integers(0, 2, (256, 256, 1)) * 255).astype(np.uint8).repeat(3, axis=2)
    scene = textured_wall(make_scene, image, repeat=4)
    camera = PinholeCamera.from_horizontal_fov(100, 100, np.radians(40.0))
    T = base_pose(0.0, 0.0, 0.0, 0.0) @ ZED.T_base_camera(0.0)
    picture = SceneRenderer(scene).render(camera, T)
    shades = picture.color[picture.instance == 0].astype(float)
    assert shades.std() < 35.0
    assert 100.0 < shades.mean() < 150.0
