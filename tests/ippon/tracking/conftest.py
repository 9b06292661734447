"""Rendered frames of a camera that a hand leads through a furnished room."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform, rotation_y, rotation_z
from ippon.simulation.camera.renderer import SceneRenderer
from ippon.simulation.camera.sensor_noise import NoiseConfig, SensorNoise
from tests.boxes import boxes_scene

ROOM = [
    ("floor", "floor", (-0.1, -0.1, -0.1), (5.1, 4.1, 0.0)),
    ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, 4.1, 2.5)),
    ("wall", "wall", (5.0, -0.1, 0.0), (5.1, 4.1, 2.5)),
    ("wall", "wall", (0.0, -0.1, 0.0), (5.0, 0.0, 2.5)),
    ("wall", "wall", (0.0, 4.0, 0.0), (5.0, 4.1, 2.5)),
    ("table", "table", (3.6, 2.8, 0.0), (4.4, 3.6, 0.75)),
    ("cabinet", "cabinet", (4.5, 0.2, 0.0), (5.0, 1.4, 1.8)),
    ("chair", "chair", (2.8, 3.0, 0.0), (3.2, 3.4, 0.9)),
    ("box", "box", (0.2, 2.0, 0.0), (0.8, 2.9, 1.1)),
    ("sofa", "sofa", (1.2, 0.0, 0.0), (2.6, 0.8, 0.6)),
    ("shelf", "shelf", (3.0, 0.0, 0.0), (3.6, 0.35, 1.6)),
    ("post", "post", (4.85, 2.1, 0.0), (5.0, 2.3, 2.5)),
    ("shelf", "shelf", (1.4, 3.7, 0.0), (2.2, 4.0, 1.4)),
    ("box", "box", (0.0, 0.9, 0.0), (0.4, 1.4, 0.8)),
    ("box", "box", (0.1, 3.3, 0.0), (0.6, 3.8, 0.5)),
]


@dataclass(frozen=True)
class Walk:
    camera: PinholeCamera
    poses: list
    frames: list

    def errors(self, poses):
        """Return metres and degrees of each pose's error, both from the first pose on."""
        found = []
        for true, pose in zip(self.poses, poses, strict=True):
            relative = np.linalg.inv(np.linalg.inv(self.poses[0]) @ true) @ (
                np.linalg.inv(poses[0]) @ pose
            )
            angle = math.acos(min(1.0, 0.5 * (np.trace(relative[:3, :3]) - 1.0)))
            found.append((float(np.linalg.norm(relative[:3, 3])), math.degrees(angle)))
        return np.array(found)


def held_pose(k):
    """Return T_world_camera of frame k: a turn by 4 degrees a frame, with a hand's unrest."""
    yaw, tilt = math.radians(4.0 * k), math.radians(-20.0 + 3.0 * math.sin(0.7 * k))
    at = (2.4 + 0.3 * math.cos(yaw), 2.0 + 0.3 * math.sin(yaw), 1.3 + 0.02 * math.sin(1.3 * k))
    return make_transform(rotation_z(yaw) @ rotation_y(-tilt) @ R_BASE_CAMERA_LEVEL, at)


@pytest.fixture(scope="session")
def walk():
    """Walk once around, 90 frames, with the noise of a depth camera."""
    camera = PinholeCamera.from_horizontal_fov(320, 240, math.radians(69.0))
    scene = boxes_scene(ROOM)
    # Faces of their own colours: odometry looks at the image, too.
    colors = np.random.default_rng(5).integers(40, 220, scene.face_colors.shape)
    scene.face_colors[:] = colors
    renderer, rng = SceneRenderer(scene), np.random.default_rng(3)
    noise = SensorNoise(camera, 0.3, 5.0, NoiseConfig(), 3)
    poses, frames = [held_pose(k) for k in range(90)], []
    for pose in poses:
        image = renderer.render(camera, pose)
        frames.append(
            (noise.corrupt_color(image.color, rng), noise.corrupt_depth(image.depth, rng))
        )
    return Walk(camera, poses, frames)
