"""Evidence of the object from beyond the map's range.

The map integrates object labels within `MapConfig.ooi_max_range_m`, as in the paper. Images also
show the object farther off. Each image column gives a score, the mean of its highest pixels, and a
stretch of floor along it, bounded by far depth or by where the object meets the floor. The
log-likelihood ratio log p(image | object there) / p(image) of a score s is 1.7 log(s / 0.055).
A cell keeps a running mean over images, not a sum, because errors of successive images correlate.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.frame import Frame
from ippon.geometry import Float64Array
from ippon.mapping.far_evidence.evidence_grid import SIDE, EvidenceGrid, corner_around
from ippon.mapping.far_evidence.image_columns import read_columns
from ippon.observation import Heatmap

MOST_PX: Final = 320
"""Larger heatmaps are subsampled to this many pixels along their longer side."""
MIN_CHANGE_NAT: Final = 0.25
"""Change of a cell after which viewpoints are evaluated against the grid again."""
MAX_AGE_NS: Final = 2_000_000_000
"""Time after which fading evidence is published again."""
FLOORS_APART_M: Final = 1.0
"""Difference of height from which the robot stands on another floor, where evidence begins anew."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FarEvidenceConfig:
    """Weight of images of places beyond the map's range."""

    enabled: bool = True
    """False ignores images beyond the map's range, as in the paper."""
    reach_m: float = 10.0
    """Range up to which images count; more considers objects farther off."""
    cell_m: float = 0.25
    """Edge of a grid cell; smaller cells locate evidence more finely and cover less floor."""
    share: float = 0.35
    """Weight of an image in the running mean of a cell; less forgets more slowly and needs more
    images."""
    least_nat: float = 1.1
    """Evidence that is subtracted, since other things resemble the object; more ignores more."""
    most_nat: float = 4.0
    """Upper bound of the evidence of a cell; more trusts distant images more."""
    cue_nat: float = 2.0
    """Evidence above which a common object of level *certain* counts as if it were in the map; more
    requires clearer images of it."""
    forget_s: float = 40.0
    """Time constant of the decay of evidence that no image renews; more keeps it longer."""
    images_near: int = 3
    """Images within the map's range after which a cell is left to the map; more keeps evidence
    near the robot for longer."""
    spread_m: float = 0.75
    """Radius over which the evidence of a cell is spread, because distant positions are inexact;
    more draws viewpoints from a wider area."""

    def __post_init__(self) -> None:
        """Reject values without meaning."""
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
        if not self.forget_s > 0.0:
            raise ValueError(f"forget_s is a positive time; got {self.forget_s}")
        if not 0.0 <= self.spread_m < math.inf:
            raise ValueError(f"spread_m is at least 0; got {self.spread_m}")
        for name in ("least_nat", "cue_nat"):
            if not 0.0 <= getattr(self, name) < self.most_nat < math.inf:
                raise ValueError(
                    f"{name} lies below most_nat, both from 0 on; got {getattr(self, name)}, "
                    f"{self.most_nat}"
                )


class FarEvidence:
    """Evidence grid of one object of interest, and of common objects that are cues for it."""

    def __init__(
        self,
        config: FarEvidenceConfig,
        ooi: str,
        near_m: float,
        max_valid_m: float = 20.0,
        labels: tuple[str, ...] = (),
    ) -> None:
        """Begin without evidence.

        Args:
            config: Weight of images.
            ooi: Label of the object in heatmaps.
            near_m: Range of the map's object layer.
            max_valid_m: Depth above this is the sensor's code for no return.
            labels: Common objects to accumulate evidence for, in place of the object.
        """
        self._revision = 0
        self._config = config
        self._ooi, self._labels = ooi, labels
        self._cues: FarEvidence | None = None
        self._near_m, self._max_valid_m = near_m, max_valid_m
        self._grid: EvidenceGrid | None = None
        self._floor_z_m = 0.0
        """Height of the floor of the grid."""
        self._images = 0
        self._stamp_ns = self._published_ns = 0
        self._places = np.zeros((0, 3), np.float32)
        self._places_revision = self._published = 0

    @property
    def revision(self) -> int:
        """Number that grows whenever `ahead` or `cued` may return something else."""
        return self._revision + (0 if self._cues is None else self._cues.revision)

    def set_cues(self, labels: Iterable[str]) -> None:
        """Also accumulate evidence for common objects that the object is certainly near.

        Args:
            labels: Those objects; the object itself is left out. Evidence of unchanged labels is
                kept.
        """
        wanted = tuple(label for label in labels if label != self._ooi)
        if wanted == self.cue_labels:
            return
        self._revision = self.revision + 1
        self._cues = None
        if wanted and self._config.enabled:
            config = replace(self._config, least_nat=self._config.cue_nat)
            reach = (self._near_m, self._max_valid_m)
            self._cues = FarEvidence(config, self._ooi, *reach, wanted)
            if self._grid is not None:
                near = self._grid.near.copy()
                self._cues._begin(self._grid.corner, near, self._floor_z_m)  # noqa: SLF001

    def _begin(
        self, corner: Float64Array, near: NDArray[np.uint8], floor_z_m: float
    ) -> EvidenceGrid:
        config, self._floor_z_m = self._config, floor_z_m
        self._grid = EvidenceGrid(
            cell_m=config.cell_m,
            images_near=config.images_near,
            spread_m=config.spread_m,
            corner=corner,
            near=near,
        )
        return self._grid

    @property
    def cue_labels(self) -> tuple[str, ...]:
        """The common objects of `set_cues`."""
        return () if self._cues is None else self._cues._labels  # noqa: SLF001

    def integrate(self, frame: Frame) -> None:
        """Integrate an image; one without a heatmap of the object is ignored."""
        if self._cues is not None:
            self._cues.integrate(frame)
        heatmap, config = frame.heatmap, self._config
        if heatmap is None or heatmap.channel_of(self._ooi) is None or not config.enabled:
            return
        grid = self._grid_at(frame)
        self._images += 1
        self._fade(grid, frame.stamp_ns)
        heat = self._heat(heatmap)
        camera, T = frame.camera, frame.T_world_camera
        lens = (camera.fx, camera.fy, camera.cx, camera.cy)
        size = (camera.width / heat.shape[1], camera.height / heat.shape[0], heat.shape[0])
        up = (T[2, 0], T[2, 1], T[2, 2], T[2, 3] - float(frame.T_world_base[2, 3]))
        ranges = (self._near_m, self._max_valid_m)
        columns = read_columns(heat, frame.depth, lens, size, up, ranges)
        ranges = (self._near_m, config.reach_m, self._max_valid_m)
        change = grid.integrate(columns, frame, size, ranges, config.share, config.most_nat)
        old = self._stamp_ns - self._published_ns > MAX_AGE_NS and grid.any_published
        if change > MIN_CHANGE_NAT or old:
            self._published_ns = self._stamp_ns
            self._published += 1
            grid.publish(config.least_nat)
            self._revision += 1

    def _grid_at(self, frame: Frame) -> EvidenceGrid:
        """Return the grid of the floor that the robot stands on, which covers what is in reach."""
        grid, xy = self._grid, frame.T_world_camera[:2, 3]
        floor_z_m = float(frame.T_world_base[2, 3])
        if grid is not None and abs(floor_z_m - self._floor_z_m) <= FLOORS_APART_M:
            if not grid.covers(xy, self._config.reach_m):
                grid.centre_on(xy)
                self._revision += 1
            return grid
        if grid is not None:
            self._published += 1
            self._revision += 1
        near = np.zeros((SIDE, SIDE), np.uint8)
        return self._begin(corner_around(xy, self._config.cell_m), near, floor_z_m)

    def _heat(self, heatmap: Heatmap) -> NDArray[np.uint8]:
        """Return the (h, w) probability of the labels in units of 1/255, subsampled if large."""
        step = -(-max(heatmap.probabilities.shape[:2]) // MOST_PX)
        thinned = heatmap.probabilities[::step, ::step]
        if not self._labels:
            channel = heatmap.channel_of(self._ooi)
            assert channel is not None, "images without a channel for the object are ignored"
            return np.ascontiguousarray(thinned[..., channel])
        channels = [n for n, label in enumerate(heatmap.labels) if label in self._labels]
        # The maximum, since the faint background of many labels would add up to evidence.
        return thinned[..., channels].max(axis=-1, initial=0)

    def _fade(self, grid: EvidenceGrid, stamp_ns: int) -> None:
        """Decay the evidence over the time since the last image."""
        past_s = (stamp_ns - self._stamp_ns) * 1e-9
        self._stamp_ns = stamp_ns
        if past_s < 0.0:
            self._published_ns = stamp_ns
        # At the first image, or after a clock has restarted, the time in between is unknown.
        if self._images > 1 and past_s > 0.0:
            grid.fade(math.exp(-past_s / self._config.forget_s))

    def places(self) -> NDArray[np.float32]:
        """Return the cells with evidence: (M, 3) world x and y of the centre, and nat."""
        if self._places_revision != self._published and self._grid is not None:
            self._places_revision = self._published
            self._places = self._grid.cells(self._config.least_nat)
        return self._places

    def ahead(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return the log-likelihood ratio of the object in the views of viewpoints.

        Args:
            xy: (N, 2) positions of the viewpoints, metres.
            headings: (A,) radians.
            reach_m: (N, A) free distance along each heading, metres.

        Returns:
            (N, A) nat, 0 without evidence.
        """
        if self._grid is None:
            return np.zeros((len(xy), len(headings)), np.float32)
        return self._grid.ahead(xy, headings, reach_m)

    def cued(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.float32]
    ) -> NDArray[np.bool_]:
        """Return (N, A) whether a view holds evidence of a common object of `set_cues`.

        Args:
            xy: (N, 2) positions of the viewpoints, metres.
            headings: (A,) radians.
            reach_m: (N, A) free distance along each heading, metres.
        """
        if self._cues is None:
            return np.zeros((len(xy), len(headings)), np.bool_)
        return self._cues.ahead(xy, headings, reach_m) > 0.0
