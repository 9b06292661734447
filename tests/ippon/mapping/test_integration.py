"""What cameras and trackers do wrong, growth in every direction, and the bound on memory."""

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from ippon.camera import PinholeCamera
from ippon.errors import FrameRejectedError
from ippon.mapping.arrays import BLOCK_VOLUME, FREE, OCCUPIED
from ippon.mapping.blocks import N_FREE, N_ROWS, N_SLABS
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.surface_voxels import N_USED
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap

LABELS = ("wall", "floor")


@pytest.fixture
def world(tools):
    return tools.World.room()


def states(voxel_map):
    arrays = voxel_map.arrays()
    return {
        tuple(b): arrays.state[arrays.directory[tuple(b - arrays.origin_block)]].tobytes()
        for b in np.argwhere(arrays.directory >= 0) + arrays.origin_block
    }


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -1.0, 0.0, 65.535])
def test_pixels_that_read_nothing_change_nothing(tools, world, bad):
    frame = world.frame(tools.look(1.0, 1.0, 1.2, 0.7))
    holes = np.random.default_rng(0).random(frame.depth.shape) < 0.3
    depth = frame.depth.copy()
    depth[holes] = bad
    zeros = frame.depth.copy()
    zeros[holes] = 0.0
    a, b = VoxelMap(MapConfig(), LABELS), VoxelMap(MapConfig(), LABELS)
    a.integrate(dataclasses.replace(frame, depth=depth))
    b.integrate(dataclasses.replace(frame, depth=zeros))
    assert states(a) == states(b)
    assert (a.arrays().state == OCCUPIED).sum() > 100


def test_a_blind_frame_is_taken_and_adds_nothing(tools, world):
    frame = world.frame(tools.look(1.0, 1.0, 1.2, 0.7))
    voxel_map = VoxelMap(MapConfig(), LABELS)
    report = voxel_map.integrate(dataclasses.replace(frame, depth=np.zeros_like(frame.depth)))
    assert (report.blocks_seen, report.surface_hits) == (0, 0)
    assert voxel_map.bounds() is None
    saturated = np.full_like(frame.depth, 65.535)
    voxel_map.integrate(dataclasses.replace(frame, depth=saturated))
    assert voxel_map.bounds() is None


def test_far_depth_carves_but_makes_no_surface(tools):
    hall = tools.World.room(12.0, 4.0)
    voxel_map = VoxelMap(MapConfig(max_range_m=3.0), LABELS)
    voxel_map.integrate(hall.frame(tools.look(0.5, 2.0, 1.2, 0.0)))
    points = np.array([[3.2, 2.0, 1.2], [4.2, 2.0, 1.2], [11.95, 2.0, 1.2]])
    assert voxel_map.state_at(points).tolist() == [FREE, 0, 0]


def test_a_pose_jump_is_believed_once_enough_time_has_passed(tools, world):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    voxel_map.integrate(world.frame(tools.look(1.0, 1.0, 1.2, 0.0), stamp_ns=0))
    away = tools.look(61.0, 1.0, 1.2, 0.0)
    for second in (1, 3, 5):
        with pytest.raises(FrameRejectedError, match=r"the camera jumped 60\.00 m"):
            voxel_map.integrate(world.frame(away, stamp_ns=second * 10**9))
    voxel_map.integrate(world.frame(away, stamp_ns=6 * 10**9))
    # A clock that begins anew is another run on the same map.
    voxel_map.integrate(world.frame(tools.look(1.0, 1.0, 1.2, 0.5), stamp_ns=0))


def test_intrinsics_and_image_sizes_may_change(tools, world):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    for n, size in enumerate([(200, 150), (64, 48), (640, 480), (33, 77), (1, 1), (500, 20)]):
        camera = PinholeCamera.from_horizontal_fov(*size, 0.8 + 0.1 * n)
        pose = tools.look(1.0, 1.0, 1.2, 0.3 * n)
        voxel_map.integrate(world.frame(pose, camera=camera, stamp_ns=n * 10**9))
    occupied = voxel_map.arrays().state == OCCUPIED
    assert occupied.sum() > 500


def test_the_world_grows_in_any_direction_and_forgets_nothing(tools):
    config = MapConfig(max_camera_speed_m_s=1e6)
    voxel_map = VoxelMap(config, LABELS)
    places = [(0, 0, 0), (-40, 3, 0), (10, 55, 6), (5, -33, -7), (70, 0, 2)]
    for n, (x, y, z) in enumerate(places):
        world = tools.World([(1.5 + x, -4.0 + y, -4.0 + z, 1.7 + x, 4.0 + y, 4.0 + z)])
        pose = tools.look(0.03 + x, 0.03 + y, 0.03 + z, 0.0)
        voxel_map.integrate(world.frame(pose, stamp_ns=n * 10**9))
    points = np.array(places) + np.array([1.55, 0.03, 0.03])
    assert (voxel_map.state_at(points) == OCCUPIED).all()
    assert (voxel_map.state_at(points - np.array([0.5, 0.0, 0.0])) == FREE).all()
    low, high = voxel_map.bounds()
    assert (low <= (-40, -33, -7)).all()
    assert (high >= (71, 55, 6)).all()


@pytest.mark.parametrize("at", [(500e3, 5.8e6, 0.0), (0.0, -1e19, 0.0), (0.0, 0.0, 1e300)])
def test_a_pose_in_geographic_coordinates_is_refused(tools, world, at):
    frame = world.frame(tools.look(1.0, 1.0, 1.2, 0.0))
    pose = frame.T_world_camera.copy()
    pose[:3, 3] += at
    voxel_map = VoxelMap(MapConfig(), LABELS)
    with pytest.raises(FrameRejectedError, match=r"camera at .* more than 10 km .* such as UTM"):
        voxel_map.integrate(dataclasses.replace(frame, T_world_camera=pose))


@pytest.mark.slow
def test_the_bound_on_memory_holds_and_distances_stay_exact(tools):
    config = MapConfig(memory_limit_mb=15.0, max_range_m=3.0)
    voxel_map = VoxelMap(config, LABELS)
    dropped, used = 0, []
    for n in range(60):
        room = tools.World.room(5.0, 4.0)
        shift = 5.2 * (n // 3)
        room.boxes = [(a + shift, b, c, d + shift, e, f) for a, b, c, d, e, f in room.boxes]
        frame = room.frame(tools.look(2.0 + shift, 2.0, 1.2, 2.1 * (n % 3)), stamp_ns=n * 10**10)
        report = voxel_map.integrate(frame)
        dropped += report.blocks_dropped
        used.append(int(voxel_map._pools.used.sum()))
    assert dropped > config.max_blocks
    assert max(used) <= config.max_blocks
    assert voxel_map._pools.tally[N_ROWS] - voxel_map._pools.tally[N_FREE] == used[-1]
    # What is near was kept, what is far was given up.
    ahead = np.array([[2.0 + np.cos(4.2), 2.0 + np.sin(4.2), 1.2]])
    assert voxel_map.state_at(ahead + np.array([shift, 0.0, 0.0]))[0] == FREE
    assert voxel_map.state_at(ahead)[0] == 0
    state, has_block = tools.dense(voxel_map.arrays(), "state")
    distance, _ = tools.dense(voxel_map.arrays(), "distance")
    # The way here was given up: what is left lies at its end.
    left = tuple(slice(at.min(), at.max() + 1) for at in np.nonzero(has_block))
    exact = np.minimum(distance_transform_edt(state[left] != OCCUPIED) * 0.1, 1.0)
    assert np.abs(exact - distance[left])[has_block[left]].max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("fusion", ["places", "paper", "max"])
def test_rolling_frames_keep_memory_flat(tools, world, fusion):
    voxel_map = VoxelMap(MapConfig(fusion=fusion), LABELS)
    voxel_map.set_ooi("hat")
    rng = np.random.default_rng(0)
    camera = PinholeCamera.from_horizontal_fov(64, 48, 1.3)
    poses = tools.tour([(1.0, 1.0), (3.0, 2.0)])
    images = [world.frame(pose, camera=camera) for pose in poses]
    sizes = []
    for n in range(20 * len(images)):
        frame = images[n % len(images)]
        noise = rng.normal(0.0, 0.01, frame.depth.shape).astype(np.float32)
        p = rng.integers(0, 256, (12, 16, 3), dtype=np.uint8)
        frame = dataclasses.replace(
            frame,
            stamp_ns=n * 10**9,
            depth=np.where(frame.depth > 0, frame.depth + noise, 0).astype(np.float32),
            heatmap=Heatmap(labels=LABELS, ooi="hat", probabilities=p),
        )
        voxel_map.integrate(frame)
        if n % len(images) == len(images) - 1:
            sizes.append((voxel_map._pools.tally[N_ROWS], voxel_map.surface.tally[N_USED]))
    blocks, rows = np.array(sizes).T
    assert blocks[-1] <= 1.02 * blocks[3]
    assert rows[-1] <= 1.02 * rows[9]


def resident_mb():
    """Memory of this process that is in RAM."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read from /proc")
@pytest.mark.parametrize("count", [3_000, pytest.param(10_000, marks=pytest.mark.large)])
def test_thousands_of_frames_leave_memory_flat(tools, world, count):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    voxel_map.set_ooi("hat")
    rng = np.random.default_rng(1)
    camera = PinholeCamera.from_horizontal_fov(80, 50, 1.4)
    images = [world.frame(pose, camera=camera) for pose in tools.tour([(1.0, 1.0), (3.0, 2.0)])]
    heat = rng.integers(0, 256, (40, 12, 16, 3), dtype=np.uint8)
    noise = rng.normal(0.0, 0.01, (50, 50, 80)).astype(np.float32)
    sizes, resident = [], []
    for n in range(count):
        frame = images[n % len(images)]
        depth = np.where(frame.depth > 0, frame.depth + noise[n % len(noise)], 0)
        heatmap = Heatmap(labels=LABELS, ooi="hat", probabilities=heat[n % len(heat)])
        voxel_map.integrate(
            dataclasses.replace(
                frame, stamp_ns=n * 10**9, depth=depth.astype(np.float32), heatmap=heatmap
            )
        )
        if n % 1000 == 999:
            tally = voxel_map._pools.tally
            sizes.append((tally[N_ROWS], tally[N_SLABS], voxel_map.surface.tally[N_USED]))
            resident.append(resident_mb())
    assert (np.array(sizes[-1]) <= 1.02 * np.array(sizes[1])).all()
    assert resident[-1] <= resident[1] + 5.0


def test_a_view_that_alone_exceeds_the_limit_is_refused_and_changes_nothing(tools, world):
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=11.0), LABELS)
    voxel_map.integrate(world.frame(tools.look(2.0, 2.0, 1.2, 0.0)))
    before, used = voxel_map.arrays().state.copy(), int(voxel_map._pools.used.sum())
    wide = PinholeCamera.from_horizontal_fov(160, 160, 2.6)
    hall = tools.World([(-50.0, -50.0, -2.0, 50.0, 50.0, -1.0)])
    frame = hall.frame(tools.look(2.0, 2.0, 1.2, 0.0), camera=wide, stamp_ns=10**9)
    frame = dataclasses.replace(frame, depth=np.full((160, 160), 4.9, np.float32))
    with pytest.raises(FrameRejectedError, match="one view needs more than the 842 blocks"):
        voxel_map.integrate(frame)
    assert int(voxel_map._pools.used.sum()) == used
    assert (voxel_map.arrays().state[: len(before)] == before).all()
    assert voxel_map.revision == 1


@pytest.mark.slow
def test_a_dropped_room_is_mapped_again(tools):
    config = MapConfig(memory_limit_mb=15.0, max_range_m=3.0)
    voxel_map = VoxelMap(config, LABELS)

    def visit(shift, stamp):
        room = tools.World.room(5.0, 4.0)
        room.boxes = [(a + shift, b, c, d + shift, e, f) for a, b, c, d, e, f in room.boxes]
        dropped = 0
        for n in range(8):
            pose = tools.look(2.0 + shift, 2.0, 1.2, 0.8 * n)
            frame = room.frame(pose, stamp_ns=(stamp + n) * 10**10)
            dropped += voxel_map.integrate(frame).blocks_dropped
        return dropped

    there = np.array([[3.0, 2.0, 1.2], [4.95, 2.0, 1.2]])
    visit(0.0, 0)
    before = voxel_map.state_at(there)
    assert sum(visit(5.2 * n, 100 * n) for n in range(1, 12)) > 100
    assert (voxel_map.state_at(there) == 0).all()
    visit(0.0, 10_000)
    assert (voxel_map.state_at(there) == before).all()
    assert before[0] == FREE


@pytest.mark.slow
def test_the_same_frames_make_the_same_map(tools, world):
    def run():
        voxel_map = VoxelMap(MapConfig(), LABELS)
        for n, pose in enumerate(tools.tour([(1.0, 1.0)])):
            voxel_map.integrate(world.frame(pose, stamp_ns=n * 10**9))
        return voxel_map

    a, b = run(), run()
    for x, y in zip(a.arrays(), b.arrays(), strict=True):
        assert np.array_equal(x, y)


def test_revisions_tell_which_blocks_changed(tools, world):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    frame = world.frame(tools.look(1.0, 1.0, 1.2, 0.0))
    first = voxel_map.integrate(frame).revision
    assert (voxel_map.arrays().revision == first).sum() > 10
    for n in range(20):
        report = voxel_map.integrate(dataclasses.replace(frame, stamp_ns=n))
    assert report.blocks_changed == 0
    assert (voxel_map.arrays().revision < report.revision).all()
    behind = voxel_map.integrate(world.frame(tools.look(1.0, 1.0, 1.2, np.pi), stamp_ns=100))
    changed = voxel_map.arrays().revision == behind.revision
    coords = voxel_map._pools.coord[: len(changed)][changed]
    assert 0 < changed.sum() < len(changed)
    assert ((coords + 0.5) * 0.8)[:, 0].max() < 1.5


@pytest.mark.slow
def test_explored_area(tools, world):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    assert voxel_map.explored_m2() == 0.0
    for n, pose in enumerate(tools.tour([(1.0, 1.0), (3.0, 3.0)])):
        voxel_map.integrate(world.frame(pose, stamp_ns=n * 10**9))
    assert voxel_map.explored_m2() == pytest.approx(15.2, abs=1.0)
    layer = (voxel_map._pools.coord[:, 2] == 0) & (voxel_map._pools.used == 1)
    state = voxel_map._pools.state[layer].reshape(-1, 8, 8, 8)
    assert voxel_map.explored_m2() == pytest.approx(np.sum(state[..., 5] == FREE) * 0.01)


def test_an_invalid_config_says_what_would_work():
    with pytest.raises(ValueError, match="voxel_size_m must be positive"):
        MapConfig(voxel_size_m=0.0)
    with pytest.raises(ValueError, match=r"endpoint_depth_voxels lies in 0 to 1; got 2\.0"):
        MapConfig(endpoint_depth_voxels=2.0)
    with pytest.raises(ValueError, match=r"raise it, or use larger voxels"):
        MapConfig(voxel_size_m=0.02, memory_limit_mb=100.0)
    for limit in (60_000.0, np.inf, np.nan, 0.0):
        # Of 60 GB the voxels of the last blocks have no number that fits.
        with pytest.raises(ValueError, match=f"memory_limit_mb lies in 0 to 50000; got {limit}"):
            MapConfig(memory_limit_mb=limit)
    largest = MapConfig(memory_limit_mb=50_000.0)
    assert largest.max_blocks * BLOCK_VOLUME < np.iinfo(np.int32).max
    with pytest.raises(ValueError, match="evidence must satisfy"):
        MapConfig(hit_evidence=50)
    with pytest.raises(ValueError, match="1 to 255 different labels"):
        VoxelMap(MapConfig(memory_limit_mb=64.0), ("a", "a"))
