"""A floor grid of the log-likelihood ratio of the object, from images of places beyond the map."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.frame import Frame
from ippon.geometry import Float64Array, invert_transform
from ippon.mapping.arrays import INNER
from ippon.mapping.far_evidence.image_columns import NEUTRAL, ImageColumns

STEEPNESS: Final = 1.7
"""Log-likelihood ratio, in nat, of a score that is e times `NEUTRAL`."""
LEAST_SCORE: Final = 0.002
MOST_NAT: Final = 5.0
LEAST_DEPTH: Final = 0.2
"""Share of depth pixels with returns below which an image does not count as a view of the floor."""
OBJECT_HEIGHT_M: Final = 0.4
"""A cell is in view when the point at this height over it is."""
SLACK_M: Final = 0.6
"""Uncertainty of a distance from the floor contact or from far depth, metres."""
LOOK_M: Final = (0.8, 1.6, 2.4, 3.2, 4.0)
"""Distances ahead of a viewpoint at which the grid is sampled, metres."""
FAINT: Final = np.float32(0.01)
SIDE: Final = 512
"""Cells along a side of the grid."""


class EvidenceGrid:
    """The grid, at first centred on the camera; row and column follow world x and y.

    A cell that has been in view within the map's range `images_near` times is left to the map.
    """

    def __init__(
        self,
        *,
        cell_m: float,
        images_near: int,
        spread_m: float,
        corner: Float64Array,
        near: NDArray[np.uint8],
    ) -> None:
        """Begin without evidence.

        Args:
            cell_m: Edge of a cell.
            images_near: Images within the map's range after which a cell is left to the map.
            spread_m: Radius over which the evidence of a cell is spread.
            corner: (2,) world x and y of the corner of cell (0, 0), metres.
            near: (SIDE, SIDE) images within the map's range that have shown each cell.
        """
        self.corner, self.near = corner, near
        self._cell_m, self._images_near, self._spread_m = cell_m, images_near, spread_m
        self._log = np.zeros((SIDE, SIDE), np.float32)
        self._published = np.zeros((SIDE, SIDE), np.float32)
        self._spread = np.zeros((SIDE, SIDE), np.float32)
        self._best = np.zeros((SIDE, SIDE), np.float32)
        self._stamp = np.zeros((SIDE, SIDE), np.int32)
        self._images = 0

    def covers(self, xy: Float64Array, reach_m: float) -> bool:
        """Return whether all cells within a distance of a position (2,) lie in the grid."""
        low = xy - self.corner
        return bool((low >= reach_m).all() and (low <= SIDE * self._cell_m - reach_m).all())

    def centre_on(self, xy: Float64Array) -> None:
        """Move the grid; cells that it still covers keep their evidence."""
        corner = corner_around(xy, self._cell_m)
        i, j = np.rint((corner - self.corner) / self._cell_m).astype(np.int64).tolist()
        self.corner = corner
        for cells in (self.near, self._log, self._published, self._spread):
            moved = np.zeros_like(cells)
            kept = cells[max(0, i) : max(0, SIDE + i), max(0, j) : max(0, SIDE + j)]
            x, y = max(0, -i), max(0, -j)
            moved[x : x + kept.shape[0], y : y + kept.shape[1]] = kept[: SIDE - x, : SIDE - y]
            cells[:] = moved

    def fade(self, factor: float) -> None:
        """Multiply the evidence of every cell."""
        self._log *= np.float32(factor)
        self._log[self._log < FAINT] = 0.0

    def integrate(
        self,
        columns: ImageColumns,
        frame: Frame,
        size: tuple[float, float, int],
        ranges: tuple[float, float, float],
        share: float,
        most_nat: float,
    ) -> float:
        """Integrate one image.

        Args:
            columns: The image's scores.
            frame: The image's depth, camera and pose.
            size: Depth pixels per heatmap pixel along u and v, and heatmap rows.
            ranges: Range of the map's object layer, range of far evidence, and the depth above
                which there is no return, metres.
            share: Weight of this image in the running mean of a cell.
            most_nat: Upper bound of a cell.

        Returns:
            The largest difference of a cell from the published grid, nat.
        """
        near_m, reach_m, max_valid_m = ranges
        camera, T = frame.camera, frame.T_world_camera
        self._images += 1
        return float(
            _integrate_kernel(
                columns,
                (camera.fx, camera.fy, camera.cx, camera.cy),
                size,
                frame.depth,
                T,
                invert_transform(T),
                float(frame.T_world_base[2, 3]),
                self.corner,
                (self._cell_m, near_m, reach_m, max_valid_m),
                (share, most_nat, self._images_near),
                (self._log, self._published, self.near, self._best, self._stamp),
                self._images,
            )
        )

    def publish(self, least_nat: float) -> None:
        """Make the present evidence the one that queries read; `least_nat` is subtracted."""
        self._published[:] = self._log
        self._spread[:] = 0.0
        _spread_kernel(self._log, least_nat, round(self._spread_m / self._cell_m), self._spread)

    @property
    def any_published(self) -> bool:
        """Whether a published cell holds evidence."""
        return bool(self._published.any())

    def cells(self, least_nat: float) -> NDArray[np.float32]:
        """Return (M, 3) world x and y of the centre, and nat, of published cells above a bound."""
        cells = np.argwhere(self._published > least_nat)
        middles = self.corner + (cells + 0.5) * self._cell_m
        nat = self._published[tuple(cells.T)]
        return np.column_stack([middles, nat]).astype(np.float32)

    def ahead(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return (N, A) nat of published evidence ahead; see `FarEvidence.ahead`."""
        out = np.zeros((len(xy), len(headings)), np.float32)
        distances = np.array(LOOK_M)
        _ahead_kernel(
            self._spread, self.corner, self._cell_m, xy, headings, reach_m, distances, out
        )
        return out


def corner_around(xy: Float64Array, cell_m: float) -> Float64Array:
    """Return the corner (2,) of a grid that is centred on a position (2,), metres."""
    middle = np.floor(xy / cell_m)
    return (middle - SIDE // 2) * cell_m


@njit(allocates=True, cache=True, nogil=True)
def _integrate_kernel(
    columns, lens, size, depth, T, inverse, floor_z, corner, metres, rule, cells, image
):
    """Integrate one image; return the largest difference from the published grid, nat."""
    fx, fy, cx, cy = lens
    per_column, per_row, rows = size
    cell_m, near_m, reach_m, most_m = metres
    share, most, images_near = rule
    log, shown, near, best, stamp = cells
    change = np.float32(0.0)
    side = log.shape[0]
    touched = np.empty((2 * columns.u.shape[0] * (int(reach_m / cell_m) + 2), 2), np.int64)
    n = 0
    width = columns.u[1] - columns.u[0] if columns.u.shape[0] > 1 else 0.0
    i0, j0 = int((T[0, 3] - corner[0]) / cell_m), int((T[1, 3] - corner[1]) / cell_m)
    span = int(near_m / cell_m) + 1
    has_depth = 0
    for v in range(0, depth.shape[0], 4):
        for u in range(0, depth.shape[1], 4):
            has_depth += 0.0 < depth[v, u] <= most_m
    if 16 * has_depth < LEAST_DEPTH * depth.size:
        span = -1
    for i in range(max(0, i0 - span), min(side, i0 + span + 1)):
        for j in range(max(0, j0 - span), min(side, j0 + span + 1)):
            px, py = corner[0] + (i + 0.5) * cell_m, corner[1] + (j + 0.5) * cell_m
            if _in_view(inverse, lens, depth, px, py, floor_z + OBJECT_HEIGHT_M, near_m, most_m):
                near[i, j] = min(near[i, j] + 1, 255)
                if near[i, j] >= images_near:
                    log[i, j] = 0.0
                    change = max(change, shown[i, j])
    # A column may be a metre wide at its far end: two rays each.
    for r in range(2 * columns.u.shape[0]):
        c = r // 2
        if columns.score[c] < 0.0:
            continue
        du = ((columns.u[c] + (0.5 * (r % 2) - 0.25) * width) * per_column - 0.5 - cx) / fx
        row = columns.low[c] + 0.5 if columns.low[c] >= 0 else 0.5 * rows
        dv = (row * per_row - 0.5 - cy) / fy
        x = T[0, 0] * du + T[0, 1] * dv + T[0, 2]
        y = T[1, 0] * du + T[1, 1] * dv + T[1, 2]
        z = T[2, 0] * du + T[2, 1] * dv + T[2, 2]
        flat = np.hypot(x, y)
        if flat < 1e-3:
            continue
        first, last = near_m, reach_m
        if columns.low[c] >= 0:
            if columns.depth[c, 1] > 0.0:
                first = max(first, columns.depth[c, 0] * flat - SLACK_M)
                last = min(last, columns.depth[c, 1] * flat + SLACK_M)
            elif -z > 0.03 * flat:
                meets = (T[2, 3] - floor_z) * flat / -z
                last = min(last, max(meets, near_m) + SLACK_M)
        elif columns.end[c] > 0.0:
            last = min(last, columns.end[c] * flat + SLACK_M)
        score = max(columns.score[c], np.float32(LEAST_SCORE))
        nat = min(STEEPNESS * np.log(score / NEUTRAL), MOST_NAT)
        for k in range(int(first / cell_m), int(last / cell_m) + 1):
            away = k * cell_m
            px, py = T[0, 3] + away * x / flat, T[1, 3] + away * y / flat
            i, j = int((px - corner[0]) / cell_m), int((py - corner[1]) / cell_m)
            if not (0 <= i < side and 0 <= j < side):
                break
            if near[i, j] >= images_near:
                continue
            if stamp[i, j] != image:
                stamp[i, j] = image
                best[i, j] = nat
                touched[n, 0], touched[n, 1] = i, j
                n += 1
            else:
                best[i, j] = max(best[i, j], nat)
    for k in range(n):
        i, j = touched[k, 0], touched[k, 1]
        value = log[i, j] + share * (best[i, j] - log[i, j])
        log[i, j] = min(max(value, 0.0), most)
        change = max(change, abs(log[i, j] - shown[i, j]))
    return change


@INNER
def _in_view(inverse, lens, depth, x, y, z, near_m, most_m):
    """Tell whether an image shows a point within the map's range."""
    fx, fy, cx, cy = lens
    zc = inverse[2, 0] * x + inverse[2, 1] * y + inverse[2, 2] * z + inverse[2, 3]
    if zc <= 0.1 or zc > near_m:
        return False
    xc = inverse[0, 0] * x + inverse[0, 1] * y + inverse[0, 2] * z + inverse[0, 3]
    yc = inverse[1, 0] * x + inverse[1, 1] * y + inverse[1, 2] * z + inverse[1, 3]
    u, v = int(xc / zc * fx + cx + 0.5), int(yc / zc * fy + cy + 0.5)
    if not (0 <= u < depth.shape[1] and 0 <= v < depth.shape[0]):
        return False
    seen = depth[v, u]
    if not 0.0 < seen <= most_m:
        # No return: the surface is beyond the range, or reflects nothing.
        return True
    return seen > zc - SLACK_M


@njit(cache=True, nogil=True)
def _spread_kernel(log, least, spread, spread_log):
    side = log.shape[0]
    for i in range(side):
        for j in range(side):
            value = log[i, j] - least
            if value <= 0.0:
                continue
            for a in range(max(0, i - spread), min(side, i + spread + 1)):
                for b in range(max(0, j - spread), min(side, j + spread + 1)):
                    spread_log[a, b] = max(spread_log[a, b], value)


@njit(cache=True, nogil=True)
def _ahead_kernel(spread, corner, cell_m, xy, headings, reach_m, distances, out):
    side = spread.shape[0]
    for a in range(headings.shape[0]):
        x, y = np.cos(headings[a]), np.sin(headings[a])
        for n in range(xy.shape[0]):
            for k in range(distances.shape[0]):
                i = int((xy[n, 0] + distances[k] * x - corner[0]) / cell_m)
                j = int((xy[n, 1] + distances[k] * y - corner[1]) / cell_m)
                if not (0 <= i < side and 0 <= j < side):
                    continue
                if k == 0 or distances[k] <= reach_m[n, a]:
                    out[n, a] = max(out[n, a], spread[i, j])
