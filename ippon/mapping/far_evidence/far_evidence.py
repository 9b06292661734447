"""What images show of the object beyond the map's range: where it may stand, roughly.

The map learns of the object of interest within `MapConfig.ooi_max_range_m`, as in the paper, and a
depth camera ends soon after; the image does not. A bed at the other end of a hall fills hundreds of
pixels that the filter never hears of. They give no voxel, but a direction, and with the floor or
the depth, where there is one, a stretch along it. Each cell of the floor there keeps how much
likelier the images make it that the object is near: the log of p(image | there) / p(image).

The score of a direction is the mean of its highest pixels. In 53 searches of simulated homes,
85,600 directions, the log-likelihood ratio of a score s was 1.7 log(s / 0.055) to within 0.6 nat
from 0.01 to 0.6. Images of one thing err alike, so that a cell keeps a running mean over them and
no sum. What was once in view within the map's range is the map's matter from then on.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ippon.frame import Frame, Heatmap
from ippon.geometry import Float64Array, invert_transform
from ippon.mapping.arrays import INNER

NEUTRAL: Final = 0.055
"""Score that is as frequent with the object in that direction as without."""
STEEPNESS: Final = 1.7
"""Nat that a score of e times as much is worth."""
LEAST_SCORE: Final = 0.002
MOST_NAT: Final = 5.0
MOST_PX: Final = 320
"""Larger heatmaps are thinned to this along their longer side: it costs time and shows no more."""
COLUMNS: Final = 24
"""Directions that an image is divided into at least."""
TOP_SHARE: Final = 0.00026
"""Share of the image's pixels that make a score: what a hat fills at ten metres."""
LEAST_OPEN: Final = 0.3
"""Share of a direction that must lie beyond the map's range for its silence to count."""
LEAST_RETURNED: Final = 0.6
"""Share of that with depth from which on the greatest depth is where the view ends."""
LEAST_DEPTH: Final = 0.2
"""Share of an image with depth from which on the map has seen what it shows."""
BLOB: Final = 0.5
"""Pixels above this part of the score belong to what is seen."""
OBJECT_HEIGHT_M: Final = 0.4
"""A place is in view when this height over its floor is."""
SLACK_M: Final = 0.6
"""Uncertainty of a distance that is told by the floor, or by far depth."""
CLOSE_M: Final = 0.1
"""A place is surely in view when nothing is this much before it."""
SPREAD_M: Final = 0.75
"""Directions are narrow and far ones inexact: what is this near to a cell counts for it, too."""
LOOK_M: Final = (0.8, 1.6, 2.4, 3.2, 4.0)
"""How far ahead of a viewpoint it is looked up."""
FRESH: Final = 0.25
"""Nat by which a cell must have changed before viewpoints are weighed anew."""
COVERED_POWER: Final = 1.5
"""How much more than in proportion floor that was in view counts."""
MANY_COVERED: Final = 8
"""Cells that came to be the map's matter after which viewpoints are weighed anew, if they count."""
SHOWN_NS: Final = 1_000_000_000
"""So often what was looked over is put together for those who watch."""
STALE_NS: Final = 2_000_000_000
"""So often viewpoints are weighed anew for what has faded."""
FAINT: Final = np.float32(0.01)
SIDE: Final = 512
"""Cells along a side of the floor that is kept."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FarEvidenceConfig:
    """How far images are believed beyond the map's range."""

    enabled: bool = True
    """Without it nothing is taken from beyond the map's range, as in the paper."""
    reach_m: float = 10.0
    """What looks like the object is not looked for farther off."""
    cell_m: float = 0.25
    share: float = 0.35
    """Of an image in the running mean of a cell; less forgets more slowly and wants more images."""
    least_nat: float = 1.1
    """Evidence that is left out: other things look like the object in many images, too. Of what
    had 1.5 to 2.5, 2.5 to 3.3 and 3.3 to 4 nat in the first 40 s of 23 searches 0.22, 0.31 and 0.63
    were the object, which is about what the rest makes of an average level's 0.1."""
    most_nat: float = 4.0
    """Bound of what images can say from afar."""
    cue_nat: float = 2.0
    """Evidence from which a common object that the object is certainly near counts from afar as if
    the map had it. In 20 searches with a context such as "on the sofa" viewpoints that look
    there found the object nine times as often as those without any."""
    forget_s: float = 40.0
    """After so long without an image of it 0.37 is left: what was something else is looked at and
    done with, but the places behind it, which it might have been at, are never seen."""
    covered_share: float = 0.0
    """What floor ahead that has been in view within the map's range takes from the object's odds:
    they fall with (1 - covered_share * its share) to the power of 1.5. More leaves corners for
    later, and what lies behind floor that was in view with them (docs/decisions.md)."""
    images_near: int = 3
    """Images within the map's range after which a place is left to the map."""

    def __post_init__(self) -> None:
        """Reject numbers without meaning."""
        if not (0.0 < self.reach_m < math.inf and 0.0 < self.cell_m < math.inf):
            raise ValueError(
                f"reach_m and cell_m are positive metres; got {self.reach_m}, {self.cell_m}"
            )
        if self.reach_m > 0.25 * SIDE * self.cell_m:
            raise ValueError(
                f"cells of {self.cell_m} m reach {0.25 * SIDE * self.cell_m:g} m; got reach_m "
                f"{self.reach_m}"
            )
        if not (0.0 < self.share <= 1.0 and self.images_near >= 1):
            raise ValueError(
                "share lies in (0, 1] and images_near is at least 1; got "
                f"{self.share}, {self.images_near}"
            )
        if not 0.0 <= self.covered_share < 1.0:
            raise ValueError(f"covered_share lies in [0, 1); got {self.covered_share}")
        if not self.forget_s > 0.0:
            raise ValueError(f"forget_s is a positive time; got {self.forget_s}")
        for name in ("least_nat", "cue_nat"):
            if not 0.0 <= getattr(self, name) < self.most_nat < math.inf:
                raise ValueError(
                    f"{name} lies below most_nat, both from 0 on; got {getattr(self, name)}, "
                    f"{self.most_nat}"
                )


class FarEvidence:
    """Remembers, for one object of interest, where images showed it from afar, and what is done."""

    def __init__(
        self,
        config: FarEvidenceConfig,
        ooi: str,
        near_m: float,
        max_valid_m: float = 20.0,
        labels: tuple[str, ...] = (),
    ) -> None:
        """Begin with nothing.

        Args:
            config: How far images are believed.
            ooi: Label of the object, as heatmaps call it.
            near_m: Range within which the map learns of it.
            max_valid_m: Depth above this is a sensor's code for none.
            labels: Common objects to remember in place of the object.
        """
        self._revision = 0
        self._config = config
        self._ooi, self._labels = ooi, labels
        self._cues: FarEvidence | None = None
        self._near_m, self._max_valid_m = near_m, max_valid_m
        self._corner: Float64Array | None = None
        self._log = np.zeros((SIDE, SIDE), np.float32)
        self._near = np.zeros((SIDE, SIDE), np.uint8)
        self._open = np.zeros((SIDE, SIDE), np.bool_)
        self._shown = np.zeros((SIDE, SIDE), np.float32)
        self._wide = np.zeros((SIDE, SIDE), np.float32)
        self._best = np.zeros((SIDE, SIDE), np.float32)
        self._stamp = np.zeros((SIDE, SIDE), np.int32)
        self._images = self._covered = 0
        self._stamp_ns = self._shown_ns = 0
        self._places = np.zeros((0, 3), np.float32)
        self._places_at = self._shown_times = 0
        self._looked_over = np.zeros((0, 3), np.int32)
        self._looked_over_ns: int | None = None
        self._looked_over_cells = 0

    @property
    def revision(self) -> int:
        """Grows whenever viewpoints may be worth something else."""
        return self._revision + (0 if self._cues is None else self._cues.revision)

    def set_cues(self, labels: Iterable[str]) -> None:
        """Remember, too, where images show common objects that the object is certainly near.

        Args:
            labels: Of them; the object itself is none. What is remembered of the same ones stays.
        """
        wanted = tuple(label for label in labels if label != self._ooi)
        if wanted == self.cue_labels:
            return
        self._revision = self.revision + 1
        self._cues = None
        if wanted and self._config.enabled:
            config = replace(self._config, covered_share=0.0, least_nat=self._config.cue_nat)
            reach = (self._near_m, self._max_valid_m)
            self._cues = FarEvidence(config, self._ooi, *reach, wanted)
            if self._corner is not None:
                self._cues._go_on_in(self._corner, self._near)  # noqa: SLF001

    def _go_on_in(self, corner: Float64Array, near: NDArray[np.uint8]) -> None:
        """Take over which cells are the map's matter already."""
        self._corner, self._near = corner, near.copy()

    @property
    def cue_labels(self) -> tuple[str, ...]:
        """The common objects that are remembered, too."""
        return () if self._cues is None else self._cues._labels  # noqa: SLF001

    def integrate(self, frame: Frame) -> None:
        """Take an image; one without a heatmap of the object says nothing."""
        if self._cues is not None:
            self._cues.integrate(frame)
        heatmap, config = frame.heatmap, self._config
        if heatmap is None or heatmap.ooi != self._ooi:
            return
        if not (config.enabled or config.covered_share):
            return
        if self._corner is None:
            middle = np.floor(frame.T_world_camera[:2, 3] / config.cell_m)
            self._corner = (middle - SIDE // 2) * config.cell_m
        self._images += 1
        self._forget(frame.stamp_ns)
        heat = self._heat(heatmap)
        camera, T = frame.camera, frame.T_world_camera
        lens = (camera.fx, camera.fy, camera.cx, camera.cy)
        size = (camera.width / heat.shape[1], camera.height / heat.shape[0], heat.shape[0])
        floor_z_m = float(frame.T_world_base[2, 3])
        up = (T[2, 0], T[2, 1], T[2, 2], T[2, 3] - floor_z_m)
        ranges = (self._near_m, self._max_valid_m)
        columns = (
            _columns(heat, frame.depth, lens, size, up, ranges) if config.enabled else _NO_COLUMNS
        )
        change, covered, surely = _mark_kernel(
            columns,
            lens,
            size,
            frame.depth,
            T,
            invert_transform(T),
            floor_z_m,
            self._corner,
            (config.cell_m, self._near_m, config.reach_m, self._max_valid_m),
            (config.share, config.most_nat, config.images_near),
            (self._log, self._shown, self._near, self._open, self._best, self._stamp),
            self._images,
        )
        self._covered += covered
        self._looked_over_cells += surely
        old = self._stamp_ns - self._shown_ns > STALE_NS and bool(self._shown.any())
        if change > FRESH or old:
            self._shown_ns, self._covered = self._stamp_ns, 0
            self._shown[:] = self._log
            self._shown_times += 1
            self._wide[:] = 0.0
            spread = round(SPREAD_M / config.cell_m)
            _widen_kernel(self._log, config.least_nat, spread, self._wide)
            self._revision += 1
        elif config.covered_share and self._covered >= MANY_COVERED:
            self._revision += 1
            self._covered = 0

    def _heat(self, heatmap: Heatmap) -> NDArray[np.uint8]:
        """Return (h, w) probability of what is remembered in units of 1/255, thinned if large."""
        step = -(-max(heatmap.probabilities.shape[:2]) // MOST_PX)
        thinned = heatmap.probabilities[::step, ::step]
        if not self._labels:
            channel = heatmap.ooi_channel
            assert channel is not None, "a heatmap with an ooi has a channel for it"
            return np.ascontiguousarray(thinned[..., channel])
        channels = [n for n, label in enumerate(heatmap.labels) if label in self._labels]
        # Not their sum: the faint background of many labels would be seen everywhere.
        return thinned[..., channels].max(axis=-1, initial=0)

    def _forget(self, stamp_ns: int) -> None:
        """Let fade what no image has shown for a while."""
        past_s = (stamp_ns - self._stamp_ns) * 1e-9
        self._stamp_ns = stamp_ns
        if past_s < 0.0:
            self._shown_ns = stamp_ns
        # A clock that starts anew, or the first image, tells nothing of the time between.
        if self._images > 1 and past_s > 0.0:
            self._log *= np.float32(math.exp(-past_s / self._config.forget_s))
            self._log[self._log < FAINT] = 0.0

    def places(self) -> NDArray[np.float32]:
        """Return the cells where images showed it: (M, 3) world x and y of the centre, and nat."""
        if self._places_at != self._shown_times and self._corner is not None:
            self._places_at = self._shown_times
            cells = np.argwhere(self._shown > self._config.least_nat)
            middles = self._corner + (cells + 0.5) * self._config.cell_m
            nat = self._shown[tuple(cells.T)]
            self._places = np.column_stack([middles, nat]).astype(np.float32)
        return self._places

    def looked_over(self, stamp_ns: int) -> NDArray[np.int32]:
        """Return the floor that images surely had in view within the map's range.

        Args:
            stamp_ns: The robot's clock: it is put together anew once a second.

        Returns:
            (M, 3) runs of cells along y: index of the first cell in x and in y, and how many. Cell
            (i, j) reaches from (i, j) to (i + 1, j + 1) times `FarEvidenceConfig.cell_m`.
        """
        last = self._looked_over_ns
        waits = last is not None and 0 <= stamp_ns - last < SHOWN_NS
        if self._looked_over_cells and self._corner is not None and not waits:
            self._looked_over_ns, self._looked_over_cells = stamp_ns, 0
            done = self._open & (self._near >= self._config.images_near)
            edges = np.diff(np.pad(done, ((0, 0), (1, 1))).astype(np.int8), axis=1)
            first, end = np.argwhere(edges == 1), np.argwhere(edges == -1)
            corner = np.rint(self._corner / self._config.cell_m).astype(np.int64)
            runs = np.column_stack([first + corner, end[:, 1] - first[:, 1]])
            self._looked_over = runs.astype(np.int32)
        return self._looked_over

    def ahead(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Tell how much likelier images make the object in what viewpoints look at.

        Args:
            xy: (N, 2) where they stand, metres.
            headings: (A,) radians.
            reach_m: (N, A) how far each sees there.

        Returns:
            (N, A) nat, 0 where images say nothing, below where they have covered the floor ahead,
            whether a wall is before it or not: counting only what is in sight told less
            (docs/decisions.md).
        """
        out = np.zeros((len(xy), len(headings)), np.float32)
        if self._corner is not None:
            look = np.array(LOOK_M)
            config = self._config
            rule = (config.cell_m, config.images_near, config.covered_share)
            cells = (self._wide, self._near)
            _ahead_kernel(cells, self._corner, rule, xy, headings, reach_m, look, out)
        return out

    def cued(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.float32]
    ) -> NDArray[np.bool_]:
        """Tell which headings look at what may be one of the common objects of `set_cues`.

        Args:
            xy: (N, 2) where viewpoints stand, metres.
            headings: (A,) radians.
            reach_m: (N, A) how far each sees there.
        """
        if self._cues is None:
            return np.zeros((len(xy), len(headings)), np.bool_)
        return self._cues.ahead(xy, headings, reach_m) > 0.0


class _Columns(NamedTuple):
    """What an image says beyond the map's range, by direction from left to right."""

    u: Float64Array
    """(K,) middle in heatmap pixels."""
    score: NDArray[np.float32]
    """(K,) mean probability of the highest pixels; negative where nothing lies beyond."""
    low: NDArray[np.int64]
    """(K,) lowest heatmap row of what looks like the object, -1 for none."""
    depth: NDArray[np.float32]
    """(K, 2) least and greatest depth measured of it, metres; 0 where none was."""
    end: NDArray[np.float32]
    """(K,) greatest depth that is seen there, 0 where most of it returns none."""


_NO_COLUMNS: Final = _Columns(
    u=np.zeros(0),
    score=np.zeros(0, np.float32),
    low=np.zeros(0, np.int64),
    depth=np.zeros((0, 2), np.float32),
    end=np.zeros(0, np.float32),
)


def _columns(
    heat: NDArray[np.uint8],
    depth: NDArray[np.float32],
    lens: tuple[float, ...],
    size: tuple[float, float, int],
    up: tuple[float, ...],
    ranges: tuple[float, float],
) -> _Columns:
    """Read an image by direction.

    Args:
        heat: (h, w) probability of the object in units of 1/255.
        depth: (H, W) metres.
        lens: fx, fy, cx, cy of `depth`.
        size: Pixels of `depth` for one of `heat`, along u and v, and h.
        up: World z of the camera's axes, and its height over the floor, metres.
        ranges: Up to where the map learns of the object, and depth that is none, metres.
    """
    h, w = heat.shape
    width = -(-w // COLUMNS)
    first = np.arange(0, w, width)
    count = len(first)
    out = _Columns(
        u=0.5 * (first + np.minimum(first + width, w)),
        score=np.full(count, -1.0, np.float32),
        low=np.full(count, -1, np.int64),
        depth=np.zeros((count, 2), np.float32),
        end=np.zeros(count, np.float32),
    )
    top = max(1, round(TOP_SHARE * h * w))
    _columns_kernel(heat, depth, lens, size, up, ranges, width, top, out)
    return out


@njit(cache=True, nogil=True)
def _columns_kernel(heat, depth, lens, size, up, ranges, width, top, out):
    h, w = heat.shape
    height, full = depth.shape
    near, most = ranges
    histogram = np.empty(256, np.int64)
    # Depth of each pixel of a column: negative for none, 0 for what is near.
    far = np.empty((h, width), np.float32)
    for c in range(out.score.shape[0]):
        j0, j1 = c * width, min((c + 1) * width, w)
        histogram[:] = 0
        beyond, returned = 0, 0
        for i in range(h):
            v = (2 * i + 1) * height // (2 * h)
            dv = ((i + 0.5) * size[1] - 0.5 - lens[3]) / lens[1]
            for j in range(j0, j1):
                z = depth[v, (2 * j + 1) * full // (2 * w)]
                far[i, j - j0] = 0.0
                if z > 0.0 and z <= near:
                    continue
                if z > near and z <= most:
                    far[i, j - j0] = z
                    returned += 1
                    out.end[c] = max(out.end[c], z)
                else:
                    # A hole in what is near: the floor at the latest is in the way.
                    du = ((j + 0.5) * size[0] - 0.5 - lens[2]) / lens[0]
                    falls = -(up[0] * du + up[1] * dv + up[2])
                    if falls * near > up[3]:
                        continue
                    far[i, j - j0] = -1.0
                beyond += 1
                histogram[heat[i, j]] += 1
        if returned < LEAST_RETURNED * beyond:
            out.end[c] = 0.0
        if beyond < 3 * top:
            continue
        left, total = top, 0
        for code in range(255, -1, -1):
            n = min(left, histogram[code])
            total += n * code
            left -= n
            if left == 0:
                break
        score = total / (255.0 * top)
        if score < NEUTRAL:
            # Through a gap one sees little of what lies behind.
            if beyond >= LEAST_OPEN * h * (j1 - j0):
                out.score[c] = score
            continue
        here = 0
        for i in range(h):
            for j in range(j0, j1):
                if heat[i, j] < 255.0 * BLOB * score:
                    continue
                z = far[i, j - j0]
                if z == 0.0:
                    here -= 1
                    continue
                here += 1
                out.low[c] = i
                if z > 0.0:
                    out.depth[c, 0] = z if out.depth[c, 0] == 0.0 else min(z, out.depth[c, 0])
                    out.depth[c, 1] = max(z, out.depth[c, 1])
        # Most of what looks like it is near: the rest are holes in that.
        if here > 0:
            out.score[c] = score


@njit(cache=True, nogil=True)
def _mark_kernel(
    columns, lens, size, depth, T, inverse, floor_z, corner, metres, rule, cells, image
):
    """Bring the cells that an image shows up to date.

    Returns how far they are from what was shown, how many have come to be the map's matter, and how
    many of those are surely in view for the first time.
    """
    fx, fy, cx, cy = lens
    per_column, per_row, rows = size
    cell_m, near_m, reach_m, most_m = metres
    share, most, images_near = rule
    log, shown, near, open_floor, best, stamp = cells
    change, covered, surely = np.float32(0.0), 0, 0
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
            shows = _shows(inverse, lens, depth, px, py, floor_z + OBJECT_HEIGHT_M, near_m, most_m)
            if shows > 0:
                before = open_floor[i, j] and near[i, j] >= images_near
                open_floor[i, j] |= shows > 1
                near[i, j] = min(near[i, j] + 1, 255)
                covered += near[i, j] == images_near
                surely += open_floor[i, j] and near[i, j] >= images_near and not before
                if near[i, j] >= images_near:
                    log[i, j] = 0.0
                    change = max(change, shown[i, j])
    # A wide column is a metre across where it is far: two rays each.
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
    return change, covered, surely


@INNER
def _shows(inverse, lens, depth, x, y, z, near_m, most_m):
    """Tell whether an image shows a point within the map's range: 2 surely, 1 likely, 0 not."""
    fx, fy, cx, cy = lens
    zc = inverse[2, 0] * x + inverse[2, 1] * y + inverse[2, 2] * z + inverse[2, 3]
    if zc <= 0.1 or zc > near_m:
        return 0
    xc = inverse[0, 0] * x + inverse[0, 1] * y + inverse[0, 2] * z + inverse[0, 3]
    yc = inverse[1, 0] * x + inverse[1, 1] * y + inverse[1, 2] * z + inverse[1, 3]
    u, v = int(xc / zc * fx + cx + 0.5), int(yc / zc * fy + cy + 0.5)
    if not (0 <= u < depth.shape[1] and 0 <= v < depth.shape[0]):
        return 0
    seen = depth[v, u]
    if not 0.0 < seen <= most_m:
        # A hole is a surface beyond the range, or one that returns nothing.
        return 1
    if seen > zc - CLOSE_M:
        return 2
    return 1 if seen > zc - SLACK_M else 0


@njit(cache=True, nogil=True)
def _widen_kernel(log, least, spread, wide):
    side = log.shape[0]
    for i in range(side):
        for j in range(side):
            value = log[i, j] - least
            if value <= 0.0:
                continue
            for a in range(max(0, i - spread), min(side, i + spread + 1)):
                for b in range(max(0, j - spread), min(side, j + spread + 1)):
                    wide[a, b] = max(wide[a, b], value)


@njit(cache=True, nogil=True)
def _ahead_kernel(cells, corner, rule, xy, headings, reach_m, look, out):
    wide, near = cells
    cell_m, images_near, share = rule
    side = wide.shape[0]
    for a in range(headings.shape[0]):
        x, y = np.cos(headings[a]), np.sin(headings[a])
        for n in range(xy.shape[0]):
            covered = 0
            for k in range(look.shape[0]):
                i = int((xy[n, 0] + look[k] * x - corner[0]) / cell_m)
                j = int((xy[n, 1] + look[k] * y - corner[1]) / cell_m)
                if not (0 <= i < side and 0 <= j < side):
                    continue
                covered += near[i, j] >= images_near
                if k == 0 or look[k] <= reach_m[n, a]:
                    out[n, a] = max(out[n, a], wide[i, j])
            out[n, a] += COVERED_POWER * np.log(1.0 - share * covered / look.shape[0])
