"""The pose of a camera from its images alone, beside Open3D's odometry on the same images.

The images are the recorded kitchen's (a hand-held Kinect), whose own poses are the truth. Each
method gets the first pose and follows; errors are those of each frame's pose, not of a path that
was fitted afterwards.
"""

import math
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.datasets.dataset import Dataset, open_dataset, read_color, read_depth
from ippon.geometry import invert_transform
from ippon.tracking.camera_tracker import CameraTracker
from ippon.tracking.depth_points import SurfacePoints
from ippon.tracking.surface_model import SurfaceModel
from tests.benchmarks.frames import KITCHEN
from tests.benchmarks.rows import Row

DATA: Final = "redkitchen"
OUTLIER_M: Final = 0.07
FARTHEST_M: Final = 5.0
LOOKUPS: Final = 20

Pose = NDArray[np.float64]
Track = Callable[[NDArray[np.uint8], NDArray[np.float32]], Pose | None]


def tracking_rows(count: int) -> Iterator[Row]:
    """Follow the first frames of the recorded kitchen with each method."""
    if not KITCHEN.exists():
        sys.stderr.write(f"left out: the recorded kitchen is not at {KITCHEN}\n")
        return
    dataset = open_dataset(KITCHEN)
    first = dataset.frames[0].T_world_camera
    tracker = CameraTracker(dataset.camera, first)
    yield from _rows(
        "odometry and alignment to the surface",
        dataset,
        count,
        lambda color, depth: tracker.track(color, depth).T_world_camera,
    )
    yield from lookup_rows(dataset)
    for name, method, stride in (
        ("Open3D odometry, hybrid, 320 x 240", "Hybrid", 2),
        ("Open3D odometry, hybrid, 640 x 480", "Hybrid", 1),
        ("Open3D odometry, point to plane, 640 x 480", "PointToPlane", 1),
    ):
        yield from _rows(name, dataset, count, Odometry(dataset, first, method, stride).track)


def lookup_rows(dataset: Dataset) -> Iterator[Row]:
    """Look up what a camera has in view among the cells of a place of 40 m by 40 m."""
    rng = np.random.default_rng(0)
    for cells in (50_000, 600_000):
        model = SurfaceModel(0.05)
        points = rng.uniform((-20.0, -20.0, -1.0), (20.0, 20.0, 2.0), (cells, 3))
        model.add(SurfacePoints(points, np.tile((0.0, 0.0, 1.0), (cells, 1))))
        times: list[float] = []
        for _ in range(LOOKUPS):
            began = time.perf_counter()
            model.in_view(dataset.camera, np.eye(4), FARTHEST_M)
            times.append(1e3 * (time.perf_counter() - began))
        data = f"{len(model):,} cells in 40 m by 40 m"
        yield Row(name="surface in view", data=data, median_ms=float(np.median(times)))


class Odometry:
    """Open3D's RGB-D odometry from each frame to the next, begun with the step before."""

    def __init__(self, dataset: Dataset, first: Pose, method: str, stride: int) -> None:
        import open3d

        self._o3d: Any = open3d
        self._method = getattr(open3d.t.pipelines.odometry.Method, method)
        self._stride = stride
        camera = dataset.camera
        camera = camera.scaled_to(camera.width // stride, camera.height // stride)
        rows = [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]]
        self._intrinsics = open3d.core.Tensor(np.array(rows, np.float64))
        self._pose, self._step, self._last = first, np.eye(4), None

    def track(self, color: NDArray[np.uint8], depth: NDArray[np.float32]) -> Pose:
        """Return the pose of the next frame."""
        images, tensor, k = self._o3d.t.geometry, self._o3d.core.Tensor, self._stride
        height, width = depth.shape
        blocks = color.reshape(height // k, k, width // k, k, 3)
        small = np.ascontiguousarray(blocks.mean(axis=(1, 3)).astype(np.uint8))
        near = np.ascontiguousarray(depth[::k, ::k])
        image = images.RGBDImage(images.Image(tensor(small)), images.Image(tensor(near)))
        if self._last is not None:
            odometry = self._o3d.t.pipelines.odometry
            steps = [odometry.OdometryConvergenceCriteria(n) for n in (6, 6, 8)]
            loss = odometry.OdometryLossParams(OUTLIER_M, 0.02, 0.1)
            found = odometry.rgbd_odometry_multi_scale(
                image, self._last, self._intrinsics, tensor(self._step), 1.0, FARTHEST_M, steps,
                self._method, loss,
            )  # fmt: skip
            self._step = found.transformation.numpy()
            self._pose = self._pose @ self._step
        self._last = image
        return self._pose


def _rows(name: str, dataset: Dataset, count: int, track: Track) -> Iterator[Row]:
    errors: list[tuple[float, float]] = []
    times: list[float] = []
    lost = 0
    for one in dataset.frames[:count]:
        color = read_color(one.color, dataset.camera)
        depth = read_depth(one.depth, dataset.depth_unit_m, dataset.camera)
        began = time.perf_counter()
        pose = track(color, depth)
        times.append(1e3 * (time.perf_counter() - began))
        if pose is None:
            lost += 1
        else:
            errors.append(error_of(pose, one.T_world_camera))
    data = f"{DATA}, {len(times)} frames"
    square = np.sqrt(np.mean(np.square(errors), axis=0))
    largest = np.max(errors, axis=0)
    for what, value, unit in (
        ("error, root mean square", square[0], "cm"),
        ("error, largest", largest[0], "cm"),
        ("rotation, root mean square", square[1], "degrees"),
        ("rotation, largest", largest[1], "degrees"),
        ("frames without a pose", lost, ""),
    ):
        yield Row(name=f"{name}: {what}", data=data, value=float(value), unit=unit)
    yield Row(name=f"{name}: a frame", data=data, median_ms=float(np.median(times)))


def error_of(pose: Pose, truth: Pose) -> tuple[float, float]:
    """Return the distance in cm and the angle in degrees between two poses."""
    apart = invert_transform(truth) @ pose
    cos = 0.5 * (float(np.trace(apart[:3, :3])) - 1.0)
    angle = math.degrees(math.acos(max(-1.0, min(1.0, cos))))
    return 100.0 * float(np.linalg.norm(apart[:3, 3])), angle
