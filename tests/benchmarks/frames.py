"""Frames to measure with: a real kitchen, and a generated home with a noisy camera."""

import json

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform, rotation_y, rotation_z
from ippon.observation import Heatmap
from ippon.simulation.camera.renderer import SceneRenderer
from ippon.simulation.camera.sensor_noise import NoiseConfig, SensorNoise
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.scene import Scene
from ippon.simulation.segmentation.segmenter import SegmenterConfig, SimulatedSegmenter
from ippon.vocabulary import MATTERPORT_40
from tests.locations import SHARED

OOI = "hat"
KITCHEN = SHARED / "rgbd" / "redkitchen_a"


def kitchen_frames(count: int) -> list[Frame]:
    """Read the recorded kitchen, evenly thinned; its heatmaps are random but fixed."""
    meta = json.loads((KITCHEN / "sequence.json").read_text())
    camera = PinholeCamera(width=meta["width"], height=meta["height"], **meta["intrinsics"])
    rng = np.random.default_rng(0)
    frames = []
    for n in range(count):
        entry = meta["frames"][n * len(meta["frames"]) // count]
        raw = np.asarray(Image.open(KITCHEN / entry["depth"])).astype(np.float32)
        raw[raw == 65535] = 0.0
        pose = np.array(entry["camera_to_world"], dtype=np.float64)
        color = np.asarray(Image.open(KITCHEN / entry["color"]).convert("RGB"))
        frames.append(
            Frame(
                stamp_ns=n * 10**9,
                color=color,
                depth=raw * np.float32(meta["depth_unit_m"]),
                camera=camera,
                T_world_camera=pose,
                T_world_base=pose,
                tilt_rad=0.0,
                heatmap=Heatmap(
                    labels=MATTERPORT_40,
                    ooi=OOI,
                    probabilities=rng.integers(0, 256, (120, 160, 41), dtype=np.uint8),
                ),
            )
        )
    return frames


class HomeCamera:
    """A camera in a home, with the errors of a real one unless told otherwise."""

    def __init__(
        self,
        scene: Scene,
        camera: PinholeCamera,
        *,
        noise: NoiseConfig | None = None,
        segmenter: SegmenterConfig | None = None,
        ooi: str | None = OOI,
    ) -> None:
        self.scene, self.camera = scene, camera
        self._renderer = SceneRenderer(scene)
        self._noise = SensorNoise(camera, 0.3, 5.0, noise or NoiseConfig())
        self.segmenter = SimulatedSegmenter(scene, MATTERPORT_40, ooi, segmenter, seed=0)
        self._rng = np.random.default_rng(0)
        self._count = 0

    def frame(self, T_world_camera: NDArray[np.float64]) -> Frame:
        """Take the next frame from a pose."""
        n, self._count = self._count, self._count + 1
        seen = self._renderer.render(self.camera, T_world_camera)
        return Frame(
            stamp_ns=n * 10**10,
            color=seen.color,
            depth=self._noise.corrupt_depth(seen.depth, self._rng),
            camera=self.camera,
            T_world_camera=T_world_camera,
            T_world_base=make_transform(np.eye(3), (*T_world_camera[:2, 3], 0.0)),
            tilt_rad=0.0,
            heatmap=self.segmenter.segment(seen, T_world_camera[:3, 3], n),
        )


def look(x: float, y: float, z: float, yaw: float, tilt: float) -> NDArray[np.float64]:
    """Return the pose of a camera that looks along `yaw`, tilted up by `tilt`."""
    return make_transform(rotation_z(yaw) @ rotation_y(-tilt) @ R_BASE_CAMERA_LEVEL, (x, y, z))


def home_poses(scene: Scene, count: int, height: float = 1.35) -> list[NDArray[np.float64]]:
    """Return poses that look around at the home's start places, level and downwards by turns."""
    starts = scene.start_poses
    poses = []
    for n in range(count):
        at, turn = starts[n % len(starts)], n // len(starts)
        tilt = (0.0, -0.45, 0.25)[turn % 3]
        poses.append(look(at.x, at.y, height, at.yaw + 2.399963 * turn, tilt))
    return poses


def home_frames(count: int, seed: int = 3) -> list[Frame]:
    """Render a generated home at 640 x 480 with a field of view of 79 degrees."""
    scene = generate_home(seed)
    camera = PinholeCamera(width=640, height=480, fx=388.0, fy=388.0, cx=319.5, cy=239.5)
    view = HomeCamera(scene, camera)
    return [view.frame(pose) for pose in home_poses(scene, count)]


def available(count: int) -> dict[str, list[Frame]]:
    """Return the sets of frames that this checkout has, by name."""
    sets = {"home": home_frames(count)}
    if KITCHEN.exists():
        sets["redkitchen"] = kitchen_frames(count)
    return sets
