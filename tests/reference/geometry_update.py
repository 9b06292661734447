"""One image into the geometry, voxel by voxel and pixel by pixel, in float64."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import invert_transform, transform_points
from ippon.mapping.depth_image import MIN_SLOPE, SPAN
from ippon.mapping.occupancy.ray_endpoints import UpdateRules, sample_strides

Index = tuple[int, int, int]


def slope_image(depth: NDArray[np.float32], camera: PinholeCamera, cell: int) -> NDArray:
    """Perpendicular distance to the tangent plane for one metre of depth, one value a cell."""
    height, width = depth.shape
    rows, columns = -(-height // cell), -(-width // cell)
    w = np.zeros((rows, columns))
    for r in range(rows):
        for c in range(columns):
            d = depth[min(r * cell + cell // 2, height - 1), min(c * cell + cell // 2, width - 1)]
            w[r, c] = 1.0 / d if d > 0 else 0.0
    out = np.ones((rows, columns))
    for r in range(rows):
        for c in range(columns):
            if w[r, c] <= 0:
                continue
            a = _lesser(w, r, c, 0, SPAN) / (SPAN * cell)
            b = _lesser(w, r, c, SPAN, 0) / (SPAN * cell)
            x = c * cell + cell // 2 - camera.cx
            y = r * cell + cell // 2 - camera.cy
            normal = np.array([a * camera.fx, b * camera.fy, w[r, c] - a * x - b * y])
            out[r, c] = np.clip(w[r, c] / np.linalg.norm(normal), MIN_SLOPE, 1.0)
    return out


def _lesser(w: NDArray, r: int, c: int, dr: int, dc: int) -> float:
    def at(i: int, j: int) -> float:
        return w[i, j] if 0 <= i < w.shape[0] and 0 <= j < w.shape[1] else 0.0

    steps = []
    if at(r - dr, c - dc) > 0:
        steps.append(w[r, c] - at(r - dr, c - dc))
    if at(r + dr, c + dc) > 0:
        steps.append(at(r + dr, c + dc) - w[r, c])
    if len(steps) == 2 and steps[0] * steps[1] < 0:
        return 0.0
    return min(steps, key=abs) if steps else 0.0


@dataclass
class PlainGeometry:
    """Evidence and signed distance of voxels in dictionaries."""

    rules: UpdateRules
    near_m: float
    far_m: float
    evidence: dict[Index, int] = field(default_factory=dict)
    tsdf: dict[Index, tuple[float, int]] = field(default_factory=dict)
    doubtful: set[Index] = field(default_factory=set)
    """Voxels that rounding may decide either way: a border of a pixel, a voxel or a threshold."""

    def integrate(
        self,
        depth: NDArray[np.float32],
        camera: PinholeCamera,
        T_world_camera: NDArray[np.float64],
        voxels: list[Index],
    ) -> None:
        """Take an image in for the listed voxels."""
        cell = 4 if camera.width >= 480 else 2
        slope = slope_image(depth, camera, cell)
        endpoints, strides = self._endpoints(depth, camera, T_world_camera, slope, cell)
        T_camera_world = invert_transform(T_world_camera)
        rules = self.rules
        area = camera.fx * camera.fy * rules.voxel_size**2 / (strides[0] * strides[1])
        centers = transform_points(T_camera_world, (np.array(voxels) + 0.5) * rules.voxel_size)
        for voxel, (x, y, z) in zip(voxels, centers.tolist(), strict=True):
            if not self.near_m < z <= self.far_m:
                self._apply(voxel, None, endpoints.get(voxel, 0) * z * z >= rules.hit_share * area)
                continue
            u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
            if min(abs(q + 0.5 - round(q + 0.5)) for q in (u, v)) < 1e-3:
                self.doubtful.add(voxel)
            u, v = math.floor(u + 0.5), math.floor(v + 0.5)
            signed = None
            if 0 <= u < camera.width and 0 <= v < camera.height and depth[v, u] > 0:
                signed = (float(depth[v, u]) - z) * slope[v // cell, u // cell]
                for threshold in (rules.clear, -rules.behind):
                    if abs(signed - threshold) < 1e-5:
                        self.doubtful.add(voxel)
            share = endpoints.get(voxel, 0) * z * z / area
            if abs(share - rules.hit_share) < 1e-4:
                self.doubtful.add(voxel)
            self._apply(voxel, signed, endpoints.get(voxel, 0) > 0 and share >= rules.hit_share)

    def _endpoints(
        self,
        depth: NDArray[np.float32],
        camera: PinholeCamera,
        T_world_camera: NDArray[np.float64],
        slope: NDArray,
        cell: int,
    ) -> tuple[dict[Index, int], tuple[int, int]]:
        strides = sample_strides(camera, self.rules.voxel_size, self.far_m)
        endpoints: dict[Index, int] = {}
        samples = [
            (sv, su, v, u)
            for sv, v in enumerate(range(strides[1] // 2, camera.height, strides[1]))
            for su, u in enumerate(range(strides[0] // 2, camera.width, strides[0]))
        ]
        for sv, su, v, u in samples:
            d = float(depth[v, u])
            if not self.near_m <= d <= self.far_m:
                continue
            # Near samples stand for four.
            step = 1 if d >= self.far_m / 2 else 2
            if sv % step or su % step:
                continue
            z = d + self.rules.endpoint_depth / slope[v // cell, u // cell]
            ray = np.array([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0])
            point = transform_points(T_world_camera, (ray * z)[None])[0]
            exact = point / self.rules.voxel_size
            voxel = tuple(int(i) for i in np.floor(exact))
            endpoints[voxel] = endpoints.get(voxel, 0) + step**2
            if np.abs(exact - np.rint(exact)).min() < 1e-3:
                for near in (np.floor(exact - 1e-3), np.floor(exact + 1e-3)):
                    self.doubtful.add(tuple(int(i) for i in near))
        return endpoints, strides

    def _apply(self, voxel: Index, signed: float | None, is_hit: bool) -> None:
        rules = self.rules
        if signed is not None and signed > -rules.behind:
            t = min(signed / rules.truncation, 1.0)
            mean, weight = self.tsdf.get(voxel, (0.0, 0))
            mean += (t - mean) / (weight + 1)
            self.tsdf[voxel] = (mean, min(weight + 1, rules.weight_max))
        is_miss = signed is not None and signed > rules.clear and not is_hit
        if is_hit or is_miss:
            e = self.evidence.get(voxel, 0) + rules.hit * is_hit - rules.miss * is_miss
            self.evidence[voxel] = min(max(e, rules.evidence_min), rules.evidence_max)
