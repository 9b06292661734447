"""Where a robot stands in a map of another day, by the shape of what it sees.

Gravity is known, so four numbers are sought: yaw and the three coordinates. Walls and furniture
seen from above are compared at every yaw and shift by correlation (Fourier transform); the best
places are refined by ICP on the surface (open3d), kept upright, and judged by how much of what is
seen lies on the map's surface.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ippon.errors import IpponError
from ippon.frame import Frame
from ippon.geometry import Float64Array, transform_points, yaw_of
from ippon.mapping.arrays import BLOCK_EDGE, OCCUPIED
from ippon.mapping.voxel_map import VoxelMap

_CELL_M: Final = 0.1
_ICP_STEPS: Final = 30
_LEAST_POINTS: Final = 300
_NORMAL_RADIUS_M: Final = 0.3


class RegistrationError(IpponError):
    """What is seen cannot be placed in the map; the text says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RegistrationConfig:
    """When a place is certain enough."""

    yaw_steps: int = 120
    """Headings that are tried; more takes longer and starts closer."""
    candidates: int = 8
    """Places that are refined; more finds the right one among many alike."""
    lowest_m: float = 0.2
    """Above the floor; what is lower tells no place from another."""
    highest_m: float = 2.0
    """Above the floor; what is higher, ceilings and lintels, is left out."""
    inlier_m: float = 0.15
    """Distance to the map's surface within which a point fits."""
    min_fitness: float = 0.75
    """Share of the points that must fit; less places the robot where furniture was moved, and more
    often wrongly."""
    min_lead: float = 0.1
    """Fitness by which the best place must lead the next one that is elsewhere; less decides
    between rooms that look alike."""
    apart_m: float = 0.4
    """Places farther from each other than this are different ones."""
    apart_rad: float = math.radians(10.0)
    """So are headings."""

    def __post_init__(self) -> None:
        """Reject numbers without meaning."""
        if self.yaw_steps < 4 or self.candidates < 2 or not self.lowest_m < self.highest_m:
            raise ValueError(
                "yaw_steps is at least 4, candidates at least 2 and lowest_m below highest_m; got "
                f"{self.yaw_steps}, {self.candidates}, {self.lowest_m}, {self.highest_m}"
            )
        if not (0.0 < self.min_fitness <= 1.0 and self.min_lead >= 0.0 and self.inlier_m > 0.0):
            raise ValueError(
                "min_fitness lies in (0, 1], min_lead is not negative and inlier_m positive; got "
                f"{self.min_fitness}, {self.min_lead}, {self.inlier_m}"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Registration:
    """A place in the map."""

    T_map_world: Float64Array
    """(4, 4) from the world frame that the robot has now to the map's; upright."""
    fitness: float
    """Share of the seen points that lie on the map's surface."""
    rmse_m: float
    """Of the distances of these points."""
    lead: float
    """Fitness less that of the best other place."""


def surface_points(voxel_map: VoxelMap) -> Float64Array:
    """Return (M, 3) centres of the map's occupied voxels, metres."""
    arrays = voxel_map.arrays()
    rows = arrays.directory[arrays.directory >= 0]
    block, k = np.nonzero(arrays.state[rows] == OCCUPIED)
    inner = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
    index = voxel_map.block_coords[rows[block]] * BLOCK_EDGE + inner
    return (index.astype(np.float64) + 0.5) * voxel_map.config.voxel_size_m


def seen_points(frame: Frame, max_range_m: float, step: int = 2) -> Float64Array:
    """Return (N, 3) points of a frame's depth in the world frame, metres.

    Args:
        frame: Depth and pose.
        max_range_m: Farther points are left out: depth is too uncertain there.
        step: Every how many pixels one is taken, along each axis.
    """
    taken = np.zeros_like(frame.depth)
    taken[::step, ::step] = frame.depth[::step, ::step]
    taken[~(np.isfinite(taken) & (taken <= max_range_m))] = 0.0
    points_camera = frame.camera.back_project(taken).astype(np.float64)
    return transform_points(frame.T_world_camera, points_camera)


def register(
    points_world: Float64Array,
    floor_z_m: float,
    map_points: Float64Array,
    map_floor_z_m: float,
    config: RegistrationConfig | None = None,
) -> Registration:
    """Find the place in a map from which points are seen.

    Args:
        points_world: (N, 3) seen surface, in a frame whose z is up.
        floor_z_m: Height of the floor in that frame.
        map_points: (M, 3) surface of the map.
        map_floor_z_m: Height of the floor there.
        config: When a place is certain enough.

    Raises:
        RegistrationError: Too little is seen, nothing fits, or several places fit equally well.
    """
    config = config or RegistrationConfig()
    points = _told_apart(points_world, floor_z_m, config)
    surface = _told_apart(map_points, map_floor_z_m, config)
    for name, cloud in (("in view", points), ("in the map", surface)):
        if len(cloud) < _LEAST_POINTS:
            raise RegistrationError(
                f"too little is {name}: {len(cloud)} points between {config.lowest_m} and "
                f"{config.highest_m} m above the floor; {_LEAST_POINTS} are needed"
            )
    height = map_floor_z_m - floor_z_m
    source, target = _cloud_of(points), _cloud_of(surface)
    target.estimate_normals(_open3d().geometry.KDTreeSearchParamHybrid(_NORMAL_RADIUS_M, 30))
    places = [
        _refined(source, target, _upright(yaw, (x, y, height)), config)
        for yaw, x, y in _coarse_places(points, surface, config)
    ]
    places.sort(key=lambda place: -place.fitness)
    best = places[0]
    elsewhere = [p.fitness for p in places[1:] if _differ(best, p, points.mean(axis=0), config)]
    lead = best.fitness - max(elsewhere, default=0.0)
    if best.fitness < config.min_fitness:
        raise RegistrationError(
            f"what is in view fits nowhere in the map: {best.fitness:.0%} of it at best, "
            f"{config.min_fitness:.0%} are needed"
        )
    if lead < config.min_lead:
        raise RegistrationError(
            f"several places in the map fit what is in view: {best.fitness:.0%} and "
            f"{best.fitness - lead:.0%}; turn the robot so that more of the room is in view"
        )
    return Registration(
        T_map_world=best.T_map_world, fitness=best.fitness, rmse_m=best.rmse_m, lead=lead
    )


def _told_apart(points: Float64Array, floor_z_m: float, config: RegistrationConfig) -> Float64Array:
    """Return one point a cell of the surface between floor and ceiling."""
    height = points[:, 2] - floor_z_m
    points = points[(height >= config.lowest_m) & (height <= config.highest_m)]
    cloud = _cloud_of(points).voxel_down_sample(_CELL_M)
    return np.asarray(cloud.points, dtype=np.float64).reshape(-1, 3)


def _coarse_places(
    points: Float64Array, surface: Float64Array, config: RegistrationConfig
) -> list[tuple[float, float, float]]:
    """Return yaw, x and y of the places where most columns of points meet columns of the map."""
    centre = points[:, :2].mean(axis=0)
    reach = float(np.linalg.norm(points[:, :2] - centre, axis=1).max())
    low = surface[:, :2].min(axis=0) - reach - _CELL_M
    extent = surface[:, :2].max(axis=0) + reach + _CELL_M - low
    # Multiples of 32 cells: fast to transform.
    width, height = (32 * math.ceil((float(side) / _CELL_M + 1.0) / 32.0) for side in extent)
    shape = (width, height)
    there = np.zeros(shape)
    i, j = np.floor((surface[:, :2] - low) / _CELL_M).astype(np.int64).T
    there[i, j] = 1.0
    # A cell beside the surface counts for half, so that no heading falls between two steps.
    spectrum = np.fft.rfft2(np.maximum(there, 0.5 * np.asarray(ndimage.maximum_filter(there, 3))))
    found: list[tuple[float, float, float, float]] = []
    for yaw in np.arange(config.yaw_steps) * (2.0 * math.pi / config.yaw_steps):
        c, s = math.cos(yaw), math.sin(yaw)
        turned = (points[:, :2] - centre) @ np.array([[c, s], [-s, c]])
        image = np.zeros(shape)
        i, j = np.floor(turned / _CELL_M).astype(np.int64).T
        np.add.at(image, (i, j), 1.0)
        image = np.minimum(image, 3.0)
        score = np.fft.irfft2(spectrum * np.conj(np.fft.rfft2(image)), s=shape)
        peaks = score * (score == np.asarray(ndimage.maximum_filter(score, 9, mode="wrap")))
        for at in np.argsort(-peaks, axis=None)[:4].tolist():
            x, y = np.unravel_index(at, shape)
            place = low + (np.array([x, y]) + 0.5) * _CELL_M
            shift = place - np.array([[c, -s], [s, c]]) @ centre
            found.append((float(score[x, y]), float(yaw), float(shift[0]), float(shift[1])))
    found.sort(reverse=True)
    return _distinct(found, centre, config)


def _distinct(
    found: list[tuple[float, float, float, float]],
    centre: Float64Array,
    config: RegistrationConfig,
) -> list[tuple[float, float, float]]:
    """Return the best places that differ from each other."""
    kept: list[tuple[float, float, float]] = []
    at: list[Float64Array] = []
    for _, yaw, x, y in found:
        c, s = math.cos(yaw), math.sin(yaw)
        here = np.array([[c, -s], [s, c]]) @ centre + (x, y)
        if all(
            np.linalg.norm(here - other) > config.apart_m
            or abs(_turn(yaw - known[0])) > config.apart_rad
            for other, known in zip(at, kept, strict=True)
        ):
            kept.append((yaw, x, y))
            at.append(here)
        if len(kept) == config.candidates:
            break
    return kept


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Place:
    T_map_world: Float64Array
    fitness: float
    rmse_m: float


def _refined(source: Any, target: Any, start: Float64Array, config: RegistrationConfig) -> _Place:
    """Return a place after ICP with ever smaller reach; only yaw and position change.

    Args:
        source: Cloud of the points in view.
        target: Cloud of the map, with normals.
        start: T_map_world to begin with.
        config: Reach.
    """
    registration = _open3d().pipelines.registration
    points = np.asarray(source.points)
    estimation = registration.TransformationEstimationPointToPlane()
    steps = registration.ICPConvergenceCriteria(max_iteration=_ICP_STEPS)
    T = start
    for reach_m in (4.0 * config.inlier_m, 2.0 * config.inlier_m, config.inlier_m):
        result = registration.registration_icp(source, target, reach_m, T, estimation, steps)
        T = _made_upright(result.transformation, points)
    last = registration.evaluate_registration(source, target, config.inlier_m, T)
    return _Place(T_map_world=T, fitness=float(last.fitness), rmse_m=float(last.inlier_rmse))


def _made_upright(T: NDArray[np.float64], points: Float64Array) -> Float64Array:
    """Return a transform without roll and pitch that moves the middle of the points alike."""
    T = np.asarray(T, dtype=np.float64)
    yaw, middle = yaw_of(T), points.mean(axis=0)
    turned = _upright(yaw, (0.0, 0.0, 0.0))
    shift = T[:3, :3] @ middle + T[:3, 3] - turned[:3, :3] @ middle
    return _upright(yaw, (float(shift[0]), float(shift[1]), float(shift[2])))


def _upright(yaw: float, position: tuple[float, float, float]) -> Float64Array:
    c, s = math.cos(yaw), math.sin(yaw)
    T = np.eye(4)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:3, 3] = position
    return T


def _differ(one: _Place, other: _Place, middle: Float64Array, config: RegistrationConfig) -> bool:
    """Return whether two transforms put what is seen at different places."""
    a, b = (T.T_map_world[:3, :3] @ middle + T.T_map_world[:3, 3] for T in (one, other))
    turn = _turn(yaw_of(one.T_map_world) - yaw_of(other.T_map_world))
    return float(np.linalg.norm(a - b)) > config.apart_m or abs(turn) > config.apart_rad


def _turn(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)


def _cloud_of(points: Float64Array) -> Any:
    o3d = _open3d()
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.ascontiguousarray(points)))


def _open3d() -> Any:
    """Return open3d, which takes a quarter of a navigator's start to load and which few need.

    Untyped on purpose: its stubs refuse the arrays that it takes.
    """
    import open3d  # noqa: PLC0415

    return open3d
