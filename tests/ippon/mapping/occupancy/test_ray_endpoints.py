"""Counts of endpoints against the same rule written sample by sample."""

import numpy as np
import pytest
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.mapping.depth_image import prepare_depth
from ippon.mapping.occupancy.ray_endpoints import (
    CameraGeometry,
    UpdateRules,
    count_endpoints_kernel,
    make_endpoint_counts,
    make_endpoint_work,
    n_listed,
)
from ippon.mapping.occupancy.sample_rows import NO_SAMPLE, PIXEL_BITS

VOXEL_M = 0.05
BLOCKS = 14
NEAR_M, FAR_M = 0.3, 5.0
RULES = UpdateRules(VOXEL_M, 0.15, 0.15, 0.05, 0.0, 100, 20, 7, 100, -100, 0.1, 0)
T_WORLD_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.1], [-1.0, 0.0, 0.0, 2.7], [0.0, -1.0, 0.0, 2.6], [0.0, 0.0, 0.0, 1.0]]
)
"""Looks along x from one side of the box of blocks."""


def _depth(kind: str, height: int, width: int) -> NDArray[np.float32]:
    rng = np.random.default_rng(3)
    rough = rng.uniform(-0.02, 0.02, (height, width))
    depth = {"near": 1.7, "far": 3.9, "door": 1.9, "nothing": 0.0}[kind] + rough
    if kind == "door":
        depth[: height * 2 // 3, width // 4 : width // 4 + 27] += 2.0
        depth[:, -3:] = 4.5
        depth[height // 2, :] = 0.0
    return np.maximum(depth, 0.0).astype(np.float32) * (kind != "nothing")


def _expected(
    depth: NDArray[np.float32], camera: PinholeCamera, strides: tuple[int, int]
) -> tuple[dict[tuple[int, ...], int], dict[tuple[int, ...], int]]:
    """Return endpoints and the most central sample of each voxel."""
    number: dict[tuple[int, ...], int] = {}
    best: dict[tuple[int, ...], tuple[int, int]] = {}
    samples_u = -(-camera.width // strides[0])
    for sv in range(-(-camera.height // strides[1])):
        v = min(sv * strides[1] + strides[1] // 2, camera.height - 1)
        for su in range(samples_u):
            u = min(su * strides[0] + strides[0] // 2, camera.width - 1)
            d = float(depth[v, u])
            is_near = d < FAR_M / 2.0
            if not NEAR_M <= d <= FAR_M or (is_near and (su | sv) & 1):
                continue
            ray = np.array([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0, 1.0 / d])
            point = (T_WORLD_CAMERA @ ray * d)[:3] / VOXEL_M
            voxel = tuple(int(c) for c in np.floor(point))
            if min(voxel) < 0 or max(voxel) >= 8 * BLOCKS:
                continue
            number[voxel] = number.get(voxel, 0) + (4 if is_near else 1)
            away = min(int(((point - np.floor(point) - 0.5) ** 2).sum() * 2000.0), 2047)
            code = (away, sv * samples_u + su)
            best[voxel] = min(best.get(voxel, code), code)
    return number, {voxel: sample for voxel, (_, sample) in best.items()}


@pytest.mark.parametrize("kind", ["near", "far", "door", "nothing"])
@pytest.mark.parametrize(
    ("size", "strides"),
    [((96, 72), (1, 1)), ((97, 51), (1, 1)), ((189, 57), (2, 1)), ((150, 78), (3, 2))],
)
def test_endpoints_are_those_of_single_samples(
    kind: str, size: tuple[int, int], strides: tuple[int, int]
) -> None:
    width, height = size
    camera = PinholeCamera(
        width=width, height=height, fx=width * 0.7, fy=width * 0.7, cx=width / 2, cy=height / 2
    )
    depth = _depth(kind, height, width)
    view = CameraGeometry(
        np.linalg.inv(T_WORLD_CAMERA), T_WORLD_CAMERA, camera.fx, camera.fy, camera.cx, camera.cy,
        NEAR_M, FAR_M,
    )  # fmt: skip
    n = BLOCKS**3
    place = np.concatenate([[0], -1 - np.arange(n)]).astype(np.int32)
    counts = make_endpoint_counts(n)
    image = prepare_depth(depth, camera, 20.0, np.zeros((height + 2, width + 2), np.float32))
    work = make_endpoint_work(n_listed(width, strides[0]))

    count_endpoints_kernel(
        image, strides, view, RULES, (0, 0, 0, *[BLOCKS] * 3), place, work, counts
    )

    number, best = _expected(depth, camera, strides)
    got: dict[tuple[int, ...], int] = {}
    central: dict[tuple[int, ...], int] = {}
    for block in np.flatnonzero(counts.any[1:]):
        corner = np.array(np.unravel_index(block, (BLOCKS,) * 3)) * 8
        for k in np.flatnonzero(counts.number[1 + block]):
            voxel = tuple(int(c) for c in corner + np.unravel_index(k, (8, 8, 8)))
            got[voxel] = int(counts.number[1 + block, k])
            code = int(counts.best[1 + block, k])
            assert code != NO_SAMPLE
            central[voxel] = code & ((1 << PIXEL_BITS) - 1)
    assert sum(got.values()) == pytest.approx(sum(number.values()), rel=1e-3)
    # float32: a point on the border of two voxels may count for either.
    same = [voxel for voxel, count in number.items() if got.get(voxel) == count]
    assert len(same) >= 0.98 * max(len(number), len(got))
    alike = [voxel for voxel in same if central[voxel] == best[voxel]]
    assert len(alike) >= 0.95 * len(same)
    assert bool(number) == (kind != "nothing")
