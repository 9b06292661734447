"""Time of each part of a map update, one pinned thread, beside peers that pip installs."""

import dataclasses
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np
import open3d as o3d
from scipy.ndimage import distance_transform_edt

from ippon.frame import Frame
from ippon.geometry import invert_transform, make_transform
from ippon.mapping import frame_blocks, integration
from ippon.mapping.arrays import OCCUPIED
from ippon.mapping.blocks import N_ROWS
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.surface_changes import SurfaceTracker
from ippon.mapping.occupancy import distance_field
from ippon.mapping.queries import to_metres
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import HeatmapKind
from ippon.vocabulary import MATTERPORT_40
from tests.benchmarks.frames import OOI
from tests.benchmarks.rows import Row
from tests.locations import ROOT

# Named by the functions themselves, so that a type checker finds a name that is gone.
GEOMETRY: tuple[tuple[ModuleType, str], ...] = (
    (integration, integration.prepare_depth.__name__),
    (frame_blocks, frame_blocks.select_kernel.__name__),
    (integration, integration.count_endpoints_kernel.__name__),
    (integration, integration.update_kernel.__name__),
)
FUSION = integration.fuse_kernel.__name__
ROUNDS = 3
Spans = dict[str, list[float]]


@contextmanager
def timed(spans: Spans, names: Sequence[tuple[Any, str]]) -> Iterator[None]:
    """Add the milliseconds of each call of the named functions to `spans`."""
    kept = [(owner, name, getattr(owner, name)) for owner, name in names]

    def wrap(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def measured(*args: Any, **kwargs: Any) -> Any:
            start = time.perf_counter()
            result = function(*args, **kwargs)
            spans[name].append(1e3 * (time.perf_counter() - start))
            return result

        return measured

    try:
        for owner, name, function in kept:
            setattr(owner, name, wrap(name, function))
        yield
    finally:
        for owner, name, function in kept:
            setattr(owner, name, function)


def new_map(voxel_size: float, **changes: Any) -> VoxelMap:
    """Make a map that takes frames from anywhere."""
    config = MapConfig(voxel_size_m=voxel_size, max_camera_speed_m_s=1e9, **changes)
    voxel_map = VoxelMap(config, MATTERPORT_40)
    voxel_map.set_ooi(OOI)
    return voxel_map


def run(
    frames: Sequence[Frame], voxel_size: float, kind: HeatmapKind = "distribution"
) -> tuple[VoxelMap, Spans]:
    """Map all frames; returns the map and milliseconds by part, one entry a frame."""
    spans: Spans = defaultdict(list)
    parts = [*GEOMETRY, (integration, FUSION), (distance_field.DistanceField, "update")]
    voxel_map = new_map(voxel_size)
    with timed(spans, [*parts, (VoxelMap, "integrate")]):
        for frame in frames:
            # As a decoder leaves it: just written. The peers' image is copied before theirs, too.
            assert frame.heatmap is not None
            heatmap = dataclasses.replace(frame.heatmap, kind=kind)
            voxel_map.integrate(
                dataclasses.replace(frame, depth=frame.depth.copy(), heatmap=heatmap)
            )
    geometry = zip(*(spans[name] for _, name in GEOMETRY), strict=True)
    spans["geometry"] = [sum(times) for times in geometry]
    return voxel_map, spans


def open3d_ms(frames: Sequence[Frame], voxel_size: float, range_m: float = 5.0) -> list[float]:
    """Integrate depth into Open3D's VoxelBlockGrid, block 8: near surfaces only, no free space."""
    grid = o3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight"), (o3d.core.float32, o3d.core.float32), ((1), (1)), voxel_size, 8, 20000
    )
    c = frames[0].camera
    intrinsic = o3d.core.Tensor([[c.fx, 0, c.cx], [0, c.fy, c.cy], [0, 0, 1]], o3d.core.float64)
    times = []
    for frame in frames:
        depth = o3d.t.geometry.Image(o3d.core.Tensor(frame.depth))
        extrinsic = o3d.core.Tensor(invert_transform(frame.T_world_camera))
        start = time.perf_counter()
        blocks = grid.compute_unique_block_coordinates(
            depth, intrinsic, extrinsic, 1.0, range_m, 4.0
        )
        grid.integrate(blocks, depth, intrinsic, extrinsic, 1.0, range_m, 4.0)
        times.append(1e3 * (time.perf_counter() - start))
    return times


def dense_state(voxel_map: VoxelMap) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return state, distance and presence of voxels over the box of observed blocks."""
    n = int(voxel_map._pools.tally[N_ROWS])
    rows = np.flatnonzero(voxel_map._pools.used[:n])
    coord = voxel_map._pools.coord[rows]
    low, config = coord.min(axis=0), voxel_map.config
    shape = (coord.max(axis=0) - low + 1) * 8
    state, distance = np.zeros(shape, np.uint8), np.zeros(shape, np.float32)
    present = np.zeros(shape, bool)
    for row, block in zip(rows, coord - low, strict=True):
        at = tuple(slice(8 * k, 8 * k + 8) for k in block)
        state[at] = voxel_map._pools.state[row].reshape(8, 8, 8)
        squared = voxel_map._pools.squared_distance[row].reshape(8, 8, 8)
        distance[at] = to_metres(squared, config.voxel_size_m, config.distance_max_m)
        present[at] = True
    return state, distance, present


def batch_distance(voxel_map: VoxelMap) -> tuple[float, float]:
    """Return milliseconds for the whole field: ours and scipy's, after comparing the results."""
    pools, directory = voxel_map._pools, voxel_map._directory
    config = voxel_map.config
    coord = pools.coord[np.flatnonzero(pools.used)]
    field = distance_field.DistanceField(config.voxel_size_m, config.distance_max_m)
    mine, theirs = [], []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        field.update(pools, directory.rows, directory.origin, coord, coord)
        mine.append(1e3 * (time.perf_counter() - start))
    state, distance, present = dense_state(voxel_map)
    for _ in range(ROUNDS):
        start = time.perf_counter()
        exact = distance_transform_edt(state != OCCUPIED)
        theirs.append(1e3 * (time.perf_counter() - start))
    exact = np.minimum(exact * config.voxel_size_m, config.distance_max_m)
    error = float(np.abs(exact - distance)[present].max())
    if error > 1e-6:
        raise AssertionError(f"distances differ from scipy's by {error} m")
    return float(np.median(mine)), float(np.median(theirs))


def speed_rows(name: str, frames: Sequence[Frame], voxel_size: float) -> list[Row]:
    """Measure every part on one set of frames."""
    rounds: dict[str, list[float]] = defaultdict(list)
    run(frames[:3], voxel_size)
    voxel_map = new_map(voxel_size)
    for _ in range(ROUNDS):
        voxel_map, spans = run(frames, voxel_size)
        for part in ("geometry", FUSION, "update", "integrate"):
            rounds[part].append(float(np.median(spans[part])))
        # A detector's scores are pooled by places, distributions go through the paper's filter.
        _, spans = run(frames, voxel_size, kind="scores")
        for part in (FUSION, "integrate"):
            rounds[f"{part}, pooled"].append(float(np.median(spans[part])))
        rounds["open3d"].append(float(np.median(open3d_ms(frames, voxel_size))))
    ms = {part: float(np.median(times)) for part, times in rounds.items()}
    batch, scipy_ms = batch_distance(voxel_map)

    def row(what: str, value: float, peer: str | None = None, peer_ms: float | None = None) -> Row:
        return Row(
            name=what, data=name, voxel_size_m=voxel_size, median_ms=value, peer=peer,
            peer_median_ms=peer_ms,
        )  # fmt: skip

    rows = [
        row("signed distance, free space, hits", ms["geometry"], "Open3D block 8", ms["open3d"]),
        row(
            "class fusion, 41 labels, and colour",
            ms[FUSION],
            "pooled by places",
            ms[f"{FUSION}, pooled"],
        ),
        row("distance field, one frame", ms["update"]),
        row("distance field, whole map", batch, "scipy", scipy_ms),
        row("whole update", ms["integrate"], "pooled by places", ms["integrate, pooled"]),
    ]
    tracker = SurfaceTracker(voxel_map)
    tracker.update()
    # Loads kernels that the frames did not need, from disk, or compiles them.
    voxel_map.set_ooi("chair")
    again: Spans = defaultdict(list)
    with timed(again, [(tracker, "update"), (voxel_map, "set_ooi"), (voxel_map, "set_levels")]):
        for k, frame in enumerate(frames[:15]):
            voxel_map.integrate(dataclasses.replace(frame, stamp_ns=frame.stamp_ns + 10**13))
            tracker.update()
            voxel_map.set_ooi((OOI, "chair")[k % 2])
            levels = np.full(len(MATTERPORT_40), k % 4, np.uint8)
            voxel_map.set_levels(levels, np.array([0.02, 0.1, 0.25, 0.6], np.float32))
    rows += [
        row("surface delta for a view, new query", float(np.median(again["update"]))),
        row("new object of interest", float(np.max(again["set_ooi"]))),
        row("new levels", float(np.median(again["set_levels"]))),
    ]
    return rows


def growth_rows(frames: Sequence[Frame], voxel_size: float, times_larger: int = 50) -> list[Row]:
    """Compare the time per frame of a map with that of one many times larger behind it."""
    small, spans = run(frames, voxel_size)
    first = float(np.median(spans["integrate"]))
    side = int(np.ceil(np.sqrt(times_larger)))
    large = new_map(voxel_size, memory_limit_mb=16000.0)
    for n in range(times_larger):
        shift = make_transform(np.eye(3), (20.0 * (1 + n % side), 20.0 * (n // side), 0.0))
        for frame in frames:
            pose = shift @ frame.T_world_camera
            large.integrate(dataclasses.replace(frame, T_world_camera=pose))
    again: Spans = defaultdict(list)
    with timed(again, [(large, "integrate")]):
        for frame in frames:
            large.integrate(frame)
    ratio = large._pools.tally[N_ROWS] / small._pools.tally[N_ROWS]
    return [
        Row(
            name=f"whole update, map {ratio:.0f} times larger", data="home",
            voxel_size_m=voxel_size, median_ms=float(np.median(again["integrate"])),
            peer="small map", peer_median_ms=first,
        )
    ]  # fmt: skip


def start_rows() -> list[Row]:
    """Measure a process that makes every kernel ready.

    The first start compiles in two processes, on two cores where there are two; a later one loads.
    """
    code = (
        "import os, sys, time, numba; from ippon.mapping.warm_up import warm_up; "
        "first = sys.argv[1] == 'first'; "
        "os.sched_setaffinity(0, range(os.cpu_count())) if first else None; "
        "t = time.perf_counter(); list(warm_up(beside=first)); "
        "print(1e3 * (time.perf_counter() - t))"
    )
    root = ROOT
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        for start in ("first", "later"):
            done = subprocess.run(
                [sys.executable, "-c", code, start],
                cwd=root,
                env={"NUMBA_CACHE_DIR": cache, "PATH": "/usr/bin:/bin"},
                capture_output=True,
                text=True,
                check=True,
            )
            rows.append(
                Row(
                    name=f"kernels ready, {start} start",
                    data="warm_up",
                    median_ms=float(done.stdout),
                )
            )
    return rows
