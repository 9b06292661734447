"""Tracks a camera by its RGB-D images: odometry from the last frame, corrected by the surface.

Open3D's RGB-D odometry between two frames gives the start of an alignment (point to plane) to the
surface that all frames before have shown, which keeps the error from growing frame by frame. A
camera that was lost is compared with small pictures of where it has been, and aligned from there.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, invert_transform, make_transform
from ippon.tracking.depth_points import SurfacePoints, points_of
from ippon.tracking.keyframes import Keyframes
from ippon.tracking.surface_model import SurfaceModel

ODOMETRY_WIDTH: Final = 320
"""Wider images are reduced for the odometry, which loses nothing but time by it."""
_ODOMETRY_STEPS: Final = (6, 6, 8)
_ALIGNMENT_STEPS: Final = 20
_OUTLIER_M: Final = 0.07
_HUBER_M: Final = 0.02
_HUBER_INTENSITY: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerConfig:
    """When an alignment is believed."""

    cell_m: float = 0.05
    """Edge length of the cells that average the surface; less takes longer, and was no better on
    recorded frames."""
    nearest_m: float = 0.3
    """Nearer depth is not used."""
    farthest_m: float = 5.0
    """Nor is farther depth; more keeps the camera in large rooms, and takes noisier depth."""
    reaches_m: tuple[float, ...] = (0.05, 0.025)
    """Distances to the surface within which points are aligned, one after another; more follows
    faster motion, and slides along bare walls. Points within the last one fit."""
    search_reaches_m: tuple[float, ...] = (0.4, 0.2, 0.1, 0.05, 0.025)
    """The same for a camera that was lost."""
    min_points: int = 300
    """Least points of a frame."""
    min_fit: float = 0.35
    """Share of the points that must lie on the known surface; less follows the camera into unknown
    rooms faster, and believes more wrong poses."""
    min_fit_found: float = 0.5
    """The same for a camera that was lost."""
    max_step_m: float = 0.4
    """Movement between two frames above which the pose is not believed."""
    max_step_rad: float = 0.6
    """The same for rotation."""
    candidates: int = 6
    """Places that are tried in each frame while the camera is lost; more finds it sooner, and takes
    longer."""

    def __post_init__(self) -> None:
        """Reject numbers without meaning."""
        lengths = (self.cell_m, self.nearest_m, *self.reaches_m, *self.search_reaches_m)
        if not (all(x > 0.0 for x in lengths) and self.nearest_m < self.farthest_m):
            raise ValueError("lengths are positive, and nearest_m lies below farthest_m")
        if not 0.0 < self.min_fit <= self.min_fit_found <= 1.0:
            raise ValueError(
                "min_fit lies above 0 and up to min_fit_found, that up to 1; got "
                f"{self.min_fit} and {self.min_fit_found}"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackedPose:
    """The outcome of one frame."""

    T_world_camera: Float64Array | None
    """None while the camera is lost."""
    fit: float
    """Share of the frame's points that lie on the known surface; 1 for the first frame."""
    problem: str = ""
    """Why the camera is lost."""


class CameraTracker:
    """Finds the pose of each frame; the first frame has the pose that is given.

    Args:
        camera: Intrinsics of all frames.
        T_world_camera: Pose of the first frame that has enough points.
        config: When an alignment is believed.
    """

    def __init__(
        self,
        camera: PinholeCamera,
        T_world_camera: Float64Array,
        config: TrackerConfig | None = None,
    ) -> None:
        self.config = config or TrackerConfig()
        self._camera = camera
        self._stride = max(1, round(camera.width / ODOMETRY_WIDTH))
        size = (camera.width // self._stride, camera.height // self._stride)
        self._intrinsics = _matrix(camera.scaled_to(*size))
        self._model = SurfaceModel(self.config.cell_m)
        self._keyframes = Keyframes()
        self._pose = T_world_camera.copy()
        self._step = np.eye(4)
        self._last: Any = None
        self.is_lost = False
        """The last frame had no pose."""

    @property
    def surface_points(self) -> int:
        """Number of cells with surface."""
        return len(self._model)

    def track(self, color: NDArray[np.uint8], depth: NDArray[np.float32]) -> TrackedPose:
        """Return the pose of the next frame.

        Args:
            color: (H, W, 3) RGB.
            depth: (H, W) metres, registered to colour; 0 for no return.
        """
        config = self.config
        seen = points_of(depth, self._camera, config.nearest_m, config.farthest_m)
        seen = seen.thinned(config.cell_m)
        if len(seen) < config.min_points:
            return self._lose(
                f"too little depth in view: {len(seen)} points, {config.min_points} are needed"
            )
        image = self._rgbd(color, depth)
        if not len(self._model):
            return self._accept(color, seen, image, self._pose, 1.0)
        found = self._search(color, seen) if self.is_lost else self._follow(seen, image)
        if isinstance(found, str):
            return self._lose(found)
        return self._accept(color, seen, image, *found)

    def _follow(self, seen: SurfacePoints, image: Any) -> tuple[Float64Array, float] | str:
        start = self._pose @ self._odometry(image)
        pose, fit = self._aligned(seen, start, self.config.reaches_m)
        step = invert_transform(self._pose) @ pose
        moved_m, turned_rad = float(np.linalg.norm(step[:3, 3])), _angle(step)
        if fit < self.config.min_fit:
            return f"{fit:.0%} of what is in view lies on known surface"
        if moved_m > self.config.max_step_m or turned_rad > self.config.max_step_rad:
            turned = math.degrees(turned_rad)
            return (
                f"the camera moved by {moved_m:.2f} m and {turned:.0f} degrees between two frames"
            )
        return pose, fit

    def _search(
        self, color: NDArray[np.uint8], seen: SurfacePoints
    ) -> tuple[Float64Array, float] | str:
        starts = [self._pose, *self._keyframes.similar(color, self.config.candidates)]
        tried = [self._aligned(seen, T, self.config.search_reaches_m) for T in starts]
        pose, fit = max(tried, key=lambda one: one[1])
        if fit < self.config.min_fit_found:
            return f"{fit:.0%} of what is in view fits a place where the camera has been"
        return pose, fit

    def _odometry(self, image: Any) -> Float64Array:
        """Return T_last_camera by Open3D's RGB-D odometry; where that fails, as the step before."""
        odometry = _open3d().t.pipelines.odometry
        steps = [odometry.OdometryConvergenceCriteria(n) for n in _ODOMETRY_STEPS]
        loss = odometry.OdometryLossParams(_OUTLIER_M, _HUBER_M, _HUBER_INTENSITY)
        try:
            result = odometry.rgbd_odometry_multi_scale(
                image, self._last, self._intrinsics, _open3d().core.Tensor(self._step), 1.0,
                self.config.farthest_m, steps, odometry.Method.Hybrid, loss,
            )  # fmt: skip
        except RuntimeError:
            # A singular system: even images of an even surface.
            return self._step
        step = np.asarray(result.transformation.numpy(), np.float64)
        if not np.isfinite(step).all():
            return self._step
        step = _rigid(step)
        moved_m, angle = float(np.linalg.norm(step[:3, 3])), _angle(step)
        far = moved_m > self.config.max_step_m or angle > self.config.max_step_rad
        return self._step if far else step

    def _aligned(
        self, seen: SurfacePoints, start: Float64Array, reaches_m: tuple[float, ...]
    ) -> tuple[Float64Array, float]:
        """Return a pose after alignment to the surface near it, and the share that fits."""
        registration = _open3d().pipelines.registration
        surface = self._model.in_view(self._camera, start, self.config.farthest_m + reaches_m[0])
        if len(surface) < self.config.min_points // 2:
            return start, 0.0
        source, target = _cloud(seen.points), _cloud(surface.points)
        target.normals = _open3d().utility.Vector3dVector(surface.normals)
        estimation = registration.TransformationEstimationPointToPlane(
            registration.HuberLoss(_HUBER_M)
        )
        steps = registration.ICPConvergenceCriteria(1e-6, 1e-6, _ALIGNMENT_STEPS)
        pose, fit = start, 0.0
        for reach_m in reaches_m:
            result = registration.registration_icp(source, target, reach_m, pose, estimation, steps)
            if not result.fitness:
                # A floor and one wall leave a direction open, along which the solution of a
                # singular system may be tens of metres away.
                result = registration.evaluate_registration(source, target, reach_m, pose)
            pose, fit = _rigid(result.transformation), float(result.fitness)
            if not fit:
                break
        return pose, fit

    def _accept(
        self,
        color: NDArray[np.uint8],
        seen: SurfacePoints,
        image: Any,
        pose: Float64Array,
        fit: float,
    ) -> TrackedPose:
        self._step = np.eye(4) if self.is_lost else invert_transform(self._pose) @ pose
        self._pose, self._last, self.is_lost = pose, image, False
        self._model.add(seen.moved(pose))
        self._keyframes.offer(color, pose)
        return TrackedPose(T_world_camera=pose.copy(), fit=fit)

    def _lose(self, problem: str) -> TrackedPose:
        # A camera that has not begun yet has nothing to lose.
        self.is_lost = len(self._model) > 0
        return TrackedPose(T_world_camera=None, fit=0.0, problem=problem)

    def _rgbd(self, color: NDArray[np.uint8], depth: NDArray[np.float32]) -> Any:
        images, k = _open3d().t.geometry, self._stride
        height, width = (size // k * k for size in depth.shape)
        blocks = color[:height, :width].reshape(height // k, k, width // k, k, 3)
        small = np.ascontiguousarray(blocks.mean(axis=(1, 3)).astype(np.uint8))
        near = np.ascontiguousarray(depth[:height:k, :width:k])
        tensor = _open3d().core.Tensor
        return images.RGBDImage(images.Image(tensor(small)), images.Image(tensor(near)))


def _open3d() -> Any:
    """Return open3d, which takes most of a second to load, and only who tracks needs it.

    Untyped on purpose: its stubs refuse the arrays that it takes.
    """
    import open3d  # noqa: PLC0415

    return open3d


def _matrix(camera: PinholeCamera) -> Any:
    rows = [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]]
    return _open3d().core.Tensor(np.array(rows, np.float64))


def _cloud(points: Float64Array) -> Any:
    return _open3d().geometry.PointCloud(_open3d().utility.Vector3dVector(points))


def _rigid(transform: NDArray[np.float64]) -> Float64Array:
    """Return the nearest rigid transform: errors of rounding would triple with every frame."""
    u, _, vt = np.linalg.svd(transform[:3, :3])
    return make_transform(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt, transform[:3, 3])


def _angle(transform: Float64Array) -> float:
    return math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(transform[:3, :3])) - 1.0))))
