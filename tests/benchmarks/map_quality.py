"""Accuracy of the map against the home it was made from, and the memory it takes."""

from collections.abc import Sequence

import numpy as np
import open3d as o3d

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED
from ippon.mapping.blocks import N_ROWS, N_SLABS
from ippon.mapping.mesh import copy_signed_distances, extract_mesh
from ippon.mapping.objects.surface_voxels import N_USED, NO_LABEL
from ippon.mapping.queries import to_metres
from ippon.mapping.snapshot import BLOCK_LAYERS, SLAB_LAYERS, SURFACE_LAYERS
from ippon.mapping.voxel_map import VoxelMap
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.scene import Scene
from ippon.vocabulary import MATTERPORT_40
from tests.benchmarks.frames import HomeCamera, look
from tests.benchmarks.map_speed import new_map
from tests.benchmarks.rows import Row

CAMERA = PinholeCamera(width=640, height=480, fx=388.0, fy=388.0, cx=319.5, cy=239.5)
SEED = 23
"""A generated home of 111 m2."""


def thorough_frames(scene: Scene) -> list[Frame]:
    """Look around at places all over the rooms, with the errors of a real camera."""
    rng = np.random.default_rng(0)
    camera = HomeCamera(scene, CAMERA)
    frames = []
    for room in scene.rooms:
        low, high = room.polygon.min(axis=0) + 0.5, room.polygon.max(axis=0) - 0.5
        for _ in range(max(2, int(np.prod(high - low) / 3.0))):
            x, y = low + (high - low) * rng.random(2)
            turn = rng.random() * 6.28
            for k in range(8):
                tilt = (0.0, -0.45, 0.25)[k % 3]
                frames.append(camera.frame(look(x, y, 1.35, turn + 2.399963 * k, tilt)))
    return frames


def memory_mb(voxel_map: VoxelMap) -> float:
    """Return the bytes of everything in use, in millions."""
    n, m = int(voxel_map._pools.tally[N_ROWS]), int(voxel_map.surface.tally[N_USED])
    total = voxel_map._directory.rows.nbytes
    total += sum(n * getattr(voxel_map._pools, name)[0].nbytes for name in BLOCK_LAYERS)
    slabs = int(voxel_map._pools.tally[N_SLABS])
    total += sum(slabs * getattr(voxel_map._pools, name)[0].nbytes for name in SLAB_LAYERS)
    total += sum(m * getattr(voxel_map.surface, name)[0].nbytes for name in SURFACE_LAYERS)
    total += m * voxel_map.surface.voxel.itemsize
    return total / 1e6


def _voxels(voxel_map: VoxelMap) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    n = int(voxel_map._pools.tally[N_ROWS])
    rows = np.flatnonzero(voxel_map._pools.used[:n])
    k = np.arange(512)
    local = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
    index = voxel_map._pools.coord[rows][:, None] * 8 + local
    centers = (index.reshape(-1, 3) + 0.5) * voxel_map.config.voxel_size_m
    state = voxel_map._pools.state[rows].ravel()
    config = voxel_map.config
    squared = voxel_map._pools.squared_distance[rows].ravel()
    return centers, state, to_metres(squared, config.voxel_size_m, config.distance_max_m)


def _ray_scene(scene: Scene) -> "o3d.t.geometry.RaycastingScene":
    rays = o3d.t.geometry.RaycastingScene()
    rays.add_triangles(
        o3d.core.Tensor(np.ascontiguousarray(scene.vertices, np.float32)),
        o3d.core.Tensor(np.ascontiguousarray(scene.faces, np.uint32)),
    )
    return rays


def _geometry_rows(voxel_map: VoxelMap, scene: Scene) -> list[Row]:
    v = voxel_map.config.voxel_size_m
    rays = _ray_scene(scene)

    def to_surface(points: np.ndarray) -> np.ndarray:
        return rays.compute_distance(o3d.core.Tensor(points.astype(np.float32))).numpy()

    centers, state, distance = _voxels(voxel_map)
    known = state != 0
    centers, state, distance = centers[known], state[known], distance[known]
    true = to_surface(centers)
    mesh = extract_mesh(copy_signed_distances(voxel_map))
    error = to_surface(mesh.vertices)
    occupied, free = state == OCCUPIED, state == FREE
    over = (distance - np.minimum(true, voxel_map.config.distance_max_m))[free]
    through = true < 0.25 * v

    def row(name: str, value: float, unit: str) -> Row:
        return Row(name=name, data="home 23", voxel_size_m=v, value=float(value), unit=unit)

    return [
        row("zero crossing to true surface, median", 1e3 * np.median(error), "mm"),
        row("zero crossing to true surface, 95 %", 1e3 * np.quantile(error, 0.95), "mm"),
        row("distance, mean absolute error", 1e3 * np.abs(over).mean(), "mm"),
        row("distance, over-estimate, 95 %", 1e3 * np.quantile(over, 0.95), "mm"),
        row("occupied voxels that hold surface", 100 * np.mean(true[occupied] <= 0.87 * v), "%"),
        row("voxels cut by surface that are occupied", 100 * np.mean(occupied[through]), "%"),
    ]


def _label_rows(voxel_map: VoxelMap, scene: Scene, frames: Sequence[Frame]) -> list[Row]:
    """Compare labels of single frames with those of the map, both against the true instances."""
    v = voxel_map.config.voxel_size_m
    rays = _ray_scene(scene)
    truth = HomeCamera(scene, CAMERA).segmenter.true_channels()
    m = int(voxel_map.surface.tally[N_USED])
    rows = np.flatnonzero(
        (voxel_map.surface.voxel[:m] >= 0) & (voxel_map.surface.label[:m] != NO_LABEL)
    )
    at = voxel_map.surface.voxel[rows]
    k = at % 512
    local = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
    centers = (voxel_map._pools.coord[at // 512] * 8 + local + 0.5) * v
    near = rays.compute_closest_points(o3d.core.Tensor(centers.astype(np.float32)))
    label = truth[scene.face_instance[near["primitive_ids"].numpy()]]
    mine = voxel_map.surface.label[rows]
    counts = label < len(MATTERPORT_40)
    counts &= label >= 0
    single = []
    for frame in frames[::10]:
        assert frame.heatmap is not None
        p = frame.heatmap.probabilities[..., : len(MATTERPORT_40)]
        h, w = p.shape[:2]
        rows_v, columns = np.mgrid[0:h, 0:w]
        depth = frame.depth[(2 * rows_v + 1) * 480 // (2 * h), (2 * columns + 1) * 640 // (2 * w)]
        u = (columns + 0.5) * 640 / w - 0.5
        y = (rows_v + 0.5) * 480 / h - 0.5
        ray = np.stack([(u - CAMERA.cx) / CAMERA.fx, (y - CAMERA.cy) / CAMERA.fy, u * 0 + 1], -1)
        ok = depth > 0
        points = (ray * depth[..., None])[ok] @ frame.T_world_camera[:3, :3].T
        points = (points + frame.T_world_camera[:3, 3]).astype(np.float32)
        hit = rays.compute_closest_points(o3d.core.Tensor(points))["primitive_ids"].numpy()
        true = truth[scene.face_instance[hit]]
        seen = p.argmax(axis=2)[ok]
        listed = (true >= 0) & (true < len(MATTERPORT_40))
        single.append(np.mean(seen[listed] == true[listed]))
    recall = [
        np.mean(mine[counts & (label == j)] == j)
        for j in range(len(MATTERPORT_40))
        if np.count_nonzero(counts & (label == j)) >= 50
    ]
    precision = [
        np.mean(label[counts & (mine == j)] == j)
        for j in range(len(MATTERPORT_40))
        if np.count_nonzero(counts & (mine == j)) >= 50
    ]

    def row(name: str, value: float) -> Row:
        return Row(name=name, data="home 23", voxel_size_m=v, value=100 * float(value), unit="%")

    return [
        row("right label, single frames", float(np.mean(single))),
        row("right label, map", float(np.mean(mine[counts] == label[counts]))),
        row("recall of a label, map, mean over labels", float(np.mean(recall))),
        row("precision of a label, map, mean over labels", float(np.mean(precision))),
    ]


def quality_rows(voxel_size: float) -> list[Row]:
    """Measure accuracy and memory on one thoroughly seen home."""
    scene = generate_home(SEED)
    frames = thorough_frames(scene)
    voxel_map = new_map(voxel_size)
    for frame in frames:
        voxel_map.integrate(frame)
    area = sum(_area(room.polygon) for room in scene.rooms)
    assert (voxel_map.arrays().level != NOT_MAPPED).any()
    return [
        *_geometry_rows(voxel_map, scene),
        *_label_rows(voxel_map, scene, frames),
        Row(
            name=f"memory, {area:.0f} m2, {len(frames)} frames", data="home 23",
            voxel_size_m=voxel_size, value=memory_mb(voxel_map), unit="MB",
        ),
    ]  # fmt: skip


def _area(polygon: np.ndarray) -> float:
    x, y = polygon[:, 0], polygon[:, 1]
    return 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))
