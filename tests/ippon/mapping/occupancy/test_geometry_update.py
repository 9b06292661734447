"""Occupied and free: against the plain twin, thin things, floors, furniture that moves."""

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.mapping.arrays import FREE, OCCUPIED
from ippon.mapping.config import MapConfig
from ippon.mapping.occupancy.free_space import TSDF_ONE
from ippon.mapping.voxel_map import VoxelMap
from tests.reference.geometry_update import PlainGeometry


def tour_map(tools, world, poses, voxel_size=0.1, camera=None, noise=None):
    voxel_map = VoxelMap(MapConfig(voxel_size_m=voxel_size), ("thing",))
    for n, pose in enumerate(poses):
        frame = world.frame(pose, stamp_ns=n * 10**10, camera=camera, noise=noise)
        voxel_map.integrate(frame)
    return voxel_map


def round_about(tools, x, y, radii=(1.2, 2.5, 4.0), height=1.2, steps=8):
    """Poses on circles round a place, looking at it."""
    return [
        tools.look(
            x + r * np.cos(a), y + r * np.sin(a), height, a + np.pi, -np.arctan2(height - 0.5, r)
        )
        for r in radii
        for a in np.linspace(0.1, 2 * np.pi + 0.1, steps, endpoint=False)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("voxel_size", "sigma"), [(0.1, 0.0), (0.1, 0.01), (0.07, 0.01)])
def test_agrees_with_the_plain_twin(tools, voxel_size, sigma):
    world = tools.World.room(3.0, 2.6, 2.2)
    world.boxes.append((1.9, 1.3, 0.0, 2.2, 1.7, 0.9))
    camera = PinholeCamera.from_horizontal_fov(64, 48, 1.3)
    rng = np.random.default_rng(3)
    voxel_map = VoxelMap(MapConfig(voxel_size_m=voxel_size), ("thing",))
    plain = None
    for n, yaw in enumerate((0.3, 0.9, -0.4, 0.3)):
        pose = tools.look(0.613, 1.021 + 0.1 * n, 1.113, yaw, -0.2)
        frame = world.frame(
            pose,
            camera=camera,
            stamp_ns=n * 10**9,
            noise=lambda d: d + (rng.normal(0.0, sigma, d.shape) * (d > 0)).astype(np.float32),
        )
        voxel_map.integrate(frame)
        rules = voxel_map._integrator._rules()
        plain = plain or PlainGeometry(rules, 0.1, 5.0)
        lows = np.floor(np.array([-0.5, -0.5, -0.5]) / voxel_size).astype(int)
        highs = np.ceil(np.array([3.5, 3.1, 2.7]) / voxel_size).astype(int)
        voxels = [
            (i, j, k)
            for i in range(lows[0], highs[0])
            for j in range(lows[1], highs[1])
            for k in range(lows[2], highs[2])
        ]
        plain.integrate(frame.depth, camera, pose, voxels)
    arrays = voxel_map.arrays()
    evidence, tsdf, weight = {}, {}, {}
    for block in np.argwhere(arrays.directory >= 0):
        row = arrays.directory[tuple(block)]
        for column in range(512):
            at = (block + arrays.origin_block) * 8 + (column >> 6, (column >> 3) & 7, column & 7)
            voxel = tuple(int(i) for i in at)
            evidence[voxel] = int(voxel_map._pools.evidence[row, column])
            tsdf[voxel] = voxel_map._pools.tsdf[row, column] / TSDF_ONE
            weight[voxel] = int(voxel_map._pools.weight[row, column])
    sure = [v for v in voxels if v not in plain.doubtful]
    assert len(sure) > 0.9 * len(voxels)
    assert sum(plain.evidence.get(v, 0) != 0 for v in sure) > 1000
    wrong = [v for v in sure if plain.evidence.get(v, 0) != evidence.get(v, 0)]
    assert wrong == []
    for v in sure:
        mean, count = plain.tsdf.get(v, (0.0, 0))
        assert weight.get(v, 0) == count
        assert tsdf.get(v, 0.0) == pytest.approx(mean, abs=2e-3)


@pytest.mark.parametrize(
    "camera",
    [
        pytest.param(
            PinholeCamera.from_horizontal_fov(400, 250, np.radians(74.0)),
            id="400x250",
            marks=pytest.mark.slow,
        ),
        pytest.param(PinholeCamera.from_horizontal_fov(240, 150, np.radians(74.0)), id="240x150"),
    ],
)
@pytest.mark.parametrize("sigma", [0.0, 0.002])
def test_thin_things_do_not_vanish(tools, camera, sigma):
    world = tools.World.room(9.0, 9.0)
    world.boxes += [
        (4.01, 4.03, 0.0, 4.04, 4.06, 0.45),  # a chair leg, 3 cm
        (4.885, 4.885, 0.0, 4.915, 4.915, 0.45),  # another, across the corner of four voxels
        (4.2, 4.2, 0.73, 4.9, 4.7, 0.755),  # a table top, 2.5 cm
        (5.12, 4.13, 0.0, 5.32, 4.33, 0.2),  # a small object, 20 cm
    ]
    rng = np.random.default_rng(5)

    def noise(depth):
        return depth + (rng.normal(0.0, 1.0, depth.shape) * sigma * depth**2).astype(np.float32)

    poses = round_about(tools, 4.5, 4.4)
    voxel_map = tour_map(tools, world, poses, camera=camera, noise=noise)

    def occupied(points):
        return np.mean(voxel_map.state_at(np.array(points, float)) == OCCUPIED)

    z = np.arange(0.05, 0.45, 0.1)
    assert occupied([(4.025, 4.045, h) for h in z]) == 1.0
    either = [max(occupied([(x, y, h)]) for x in (4.85, 4.91) for y in (4.85, 4.91)) for h in z]
    assert np.mean(either) == 1.0
    x, y = np.meshgrid(np.arange(4.25, 4.9, 0.1), np.arange(4.25, 4.7, 0.1))
    assert occupied([(a, b, 0.74) for a, b in zip(x.ravel(), y.ravel(), strict=True)]) > 0.97
    assert occupied([(5.22, 4.23, 0.19), (5.13, 4.23, 0.1), (5.31, 4.23, 0.1)]) == 1.0
    # And what is between them stays free.
    free = voxel_map.state_at(np.array([[4.35, 4.45, 0.35], [4.65, 4.15, 0.55], [4.5, 4.4, 1.05]]))
    assert (free == FREE).all()


@pytest.mark.slow
@pytest.mark.parametrize("sigma", [0.0, 0.002])
def test_floor_seen_at_a_grazing_angle_is_one_closed_layer(tools, sigma):
    world = tools.World.room(7.0, 4.0)
    camera = PinholeCamera.from_horizontal_fov(400, 250, np.radians(74.0))
    rng = np.random.default_rng(5)

    def noise(depth):
        return depth + (rng.normal(0.0, 1.0, depth.shape) * sigma * depth**2).astype(np.float32)

    poses = [tools.look(0.5 + 0.1 * n, 2.0, 1.2, 0.0, -0.25) for n in range(12)]
    voxel_map = tour_map(tools, world, poses, camera=camera, noise=noise)
    x, y = np.meshgrid(np.arange(3.05, 5.5, 0.1), np.arange(1.05, 3.0, 0.1))
    floor = np.stack([x.ravel(), y.ravel(), np.full(x.size, -0.05)], axis=1)
    assert np.mean(voxel_map.state_at(floor) == OCCUPIED) > 0.98
    assert np.mean(voxel_map.state_at(floor + np.array([0, 0, 0.1])) == OCCUPIED) < (
        0.02 + 10 * sigma
    )
    assert np.mean(voxel_map.state_at(floor + np.array([0, 0, 0.2])) == FREE) > 0.98


@pytest.mark.slow
def test_moved_furniture_disappears_and_appears_within_the_stated_views(tools):
    config = MapConfig()
    empty = tools.World.room(6.0, 4.0)
    furnished = tools.World.room(6.0, 4.0)
    furnished.boxes.append((3.0, 1.5, 0.0, 3.6, 2.5, 0.8))
    pose = tools.look(1.0, 2.0, 1.2, 0.0, -0.3)
    voxel_map = VoxelMap(config, ("thing",))
    front = np.array([[3.05, 2.0, 0.35], [3.05, 1.7, 0.55]])
    stamp = iter(range(1000))
    for _ in range(30):
        voxel_map.integrate(furnished.frame(pose, stamp_ns=next(stamp)))
    assert (voxel_map.state_at(front) == OCCUPIED).all()
    vanishing = config.max_evidence // config.miss_evidence + 1
    for n in range(vanishing):
        assert (voxel_map.state_at(front) == OCCUPIED).all(), n
        voxel_map.integrate(empty.frame(pose, stamp_ns=next(stamp)))
    assert (voxel_map.state_at(front) == FREE).all()
    assert float(voxel_map.distance_at(front[:1])[0]) > 0.3
    for _ in range(30):
        voxel_map.integrate(empty.frame(pose, stamp_ns=next(stamp)))
    appearing = -config.min_evidence // config.hit_evidence + 1
    for _ in range(appearing):
        assert (voxel_map.state_at(front) == FREE).all()
        voxel_map.integrate(furnished.frame(pose, stamp_ns=next(stamp)))
    assert (voxel_map.state_at(front) == OCCUPIED).all()
