"""A simulated open-vocabulary segmentation with the errors of real ones."""

import math
import operator
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.observation import Heatmap
from ippon.simulation.camera.renderer import Rendering
from ippon.simulation.scene import Instance, Scene
from ippon.simulation.segmentation.confusion import affinity, is_vague, ooi_affinity
from ippon.simulation.segmentation.heatmap import (
    Float32Array,
    Int32Array,
    blend,
    compact_samples,
    neighbours,
    part_of_grid,
    sample_instances,
    sigmoid,
)
from ippon.simulation.segmentation.smooth_noise import SmoothNoise, mixed
from ippon.simulation.segmentation.truth import NamePredicate, true_label

_AZIMUTHS = 8
_FIELD_SHAPE = (6, 9)
_WARP_SHAPE = (12, 18, 2)
_BEYOND_RANGE_M = 8.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmenterConfig:
    """Quality of the simulated network. Sigmas are in logits of the right label's share.

    With the defaults 75 to 85 % of the pixels within 1 to 4 m get their right label in one frame.
    """

    longest_side_px: int = 160
    """Longer side of the heatmap; larger shows smaller objects and costs time."""
    confidence: float = 0.8
    """Share of the right label in an average case, as a logit; larger errs less."""
    stable_sigma: float = 1.0
    """Differences between objects; larger makes more objects that are misread from everywhere."""
    view_sigma: float = 0.8
    """Differences between the sides of an object; larger makes errors depend more on the view."""
    flicker_sigma: float = 1.0
    """Differences of one object over time; larger makes errors change more between frames."""
    field_sigma: float = 2.6
    """Differences between parts of the image, in patches of about an eighth of it; larger makes
    more bad patches."""
    flicker_period: int = 4
    """Frames between independent draws of the flicker; larger makes it slower."""
    favourite_sigma: float = 1.0
    """Concentration of errors on one wrong label; larger concentrates more."""
    vague_loss: float = 1.0
    """Logits that objects of the catch-all classes (objects, others, furniture) lose."""
    range_loss_per_m: float = 0.35
    """Logits lost per metre beyond `clear_range_m`; larger misreads distant objects more."""
    clear_range_m: float = 2.5
    missed_share: float = 0.0007
    """Share of the image at which an object is missed half of the time; larger misses more."""
    edge_px: float = 1.2
    """Width in heatmap pixels over which neighbouring objects mix; larger blurs outlines."""
    wobble_px: float = 1.0
    """Standard deviation of the position of outlines, in heatmap pixels."""
    haze: float = 0.12
    """Part of the wrong share that is spread equally over all labels."""

    def __post_init__(self) -> None:
        """Reject values out of range."""
        if not (8 <= self.longest_side_px <= 4096 and self.flicker_period >= 1):
            raise ValueError(
                "longest_side_px must be 8 to 4096 and flicker_period at least 1; got "
                f"{self.longest_side_px}, {self.flicker_period}"
            )
        if not (
            0.0 <= self.haze <= 1.0
            and 0.0 <= self.missed_share < 1.0
            and min(self.edge_px, self.wobble_px) >= 0
        ):
            raise ValueError(
                "haze and missed_share must be in 0..1, edge_px and wobble_px at least 0; got "
                f"{self.haze}, {self.missed_share}, {self.edge_px}, {self.wobble_px}"
            )

    @classmethod
    def perfect(cls) -> "SegmenterConfig":
        """Return a network without errors, for upper bounds and tests."""
        return cls(
            confidence=20.0,
            stable_sigma=0.0,
            view_sigma=0.0,
            flicker_sigma=0.0,
            field_sigma=0.0,
            vague_loss=0.0,
            range_loss_per_m=0.0,
            missed_share=0.0,
            edge_px=0.0,
            wobble_px=0.0,
        )


class SimulatedSegmenter:
    """Heatmaps for renderings of one scene and one set of labels.

    Errors are drawn per object, so that they persist like those of a network: some objects are
    misread from everywhere, some from one side, some for a few frames; others are drawn per patch
    of the image. An object is confused with labels that look similar (see `confusion`). Far and
    small objects are missed, and outlines mix. A frame depends only on the seed, the labels and its
    index; a change of labels keeps the errors of the other labels.
    """

    def __init__(
        self,
        scene: Scene,
        labels: Sequence[str],
        ooi: str | None,
        config: SegmenterConfig | None = None,
        seed: int = 0,
        is_instance_of: NamePredicate = operator.eq,
        *,
        also: Sequence[str] = (),
    ) -> None:
        """Draw the persistent errors.

        Args:
            scene: The home.
            labels: Common labels, canonical and distinct.
            ooi: Canonical label of the object of interest, None for none.
            config: Quality of the network.
            seed: Seed of all errors.
            is_instance_of: Compares the canonical label or category of an object with `ooi`; by
                default names must be equal, so that a couch is not a sofa.
            also: Canonical labels of further objects of interest.
        """
        self._is_instance_of = is_instance_of
        self.labels = tuple(labels)
        self.ooi, self.also = ooi, tuple(also)
        self.config = config or SegmenterConfig()
        self._seed = seed
        self._scene = scene
        if not self.labels or len(set(self.labels)) != len(self.labels):
            raise ValueError(f"labels must be distinct and at least one; got {self.labels}")
        further = (name for name in self.also if name not in (*self.labels, ooi))
        self._asked = self._channels = (*self.labels, *further)
        if ooi is not None and ooi not in self.labels:
            self._channels = (*self._asked, ooi)
        count = len(scene.instances)
        draws = self._rng(0)
        self._stable = draws.standard_normal(count)
        self._sides = draws.standard_normal((count, _AZIMUTHS))
        self._missed = draws.standard_normal(count)
        self._truth = np.array(
            [self._true_channel(instance) for instance in scene.instances], dtype=np.int64
        )
        self._bias = np.array(
            [-self.config.vague_loss * self._is_vague(k) for k in range(count)], dtype=np.float64
        )
        self._lookalikes = self._wrong_channels()
        self._centres = np.array(
            [np.add(i.aabb_min, i.aabb_max) * 0.5 for i in scene.instances], dtype=np.float64
        ).reshape(-1, 3)
        shapes = ((count,), _FIELD_SHAPE, (count, len(self._channels)))
        self._smooth = SmoothNoise(
            shapes, self.config.flicker_period, draws=lambda node: self._rng(4, node)
        )

    def true_channels(self) -> NDArray[np.int64]:
        """Return (I,) the right channel of each instance, -1 where no label names it."""
        return self._truth.copy()

    def segment(
        self,
        rendering: Rendering,
        camera_position_world: Float64Array,
        frame_index: int,
        window: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0),
    ) -> Heatmap:
        """Segment an image or a crop of it.

        Args:
            rendering: Noise-free images.
            camera_position_world: (3,) metres; decides which side of an object is in view.
            frame_index: Number of the frame, from 0; flicker is correlated between nearby frames.
            window: Top, left, height and width of a crop as shares of the image.

        Returns:
            Label probabilities; the channels of a pixel sum to 255.
        """
        height, width = rendering.instance.shape
        scale = self.config.longest_side_px / max(height, width)
        size = (max(1, round(height * scale)), max(1, round(width * scale)))
        warp = self._rng(5, frame_index).standard_normal(_WARP_SHAPE, dtype=np.float32)
        warp *= np.float32(self.config.wobble_px)
        samples = sample_instances(rendering.instance, size, self.config.edge_px, warp)
        seen, local = compact_samples(samples)
        centre = local[..., 0]
        pixels = np.bincount(centre.ravel(), minlength=len(seen))
        ranges = self._ranges(rendering.depth, centre, pixels)
        shares = self._shares(seen, ranges, camera_position_world, frame_index)
        weights = self._weights(seen, pixels / centre.size, frame_index)
        good, bad = (self._rows(seen, share, frame_index) for share in shares)
        if (weights < 0.999).any():
            beside = neighbours(centre, len(seen))
            good = weights[:, None] * good + (1.0 - weights[:, None]) * good[beside]
            bad = weights[:, None] * bad + (1.0 - weights[:, None]) * bad[beside]
        field = part_of_grid(self._smooth.at(frame_index)[1], window).astype(np.float32)
        probabilities = blend(local, good.astype(np.float32), bad.astype(np.float32), field)
        return Heatmap(labels=self._asked, ooi=self.ooi, probabilities=probabilities)

    def _true_channel(self, instance: Instance) -> int:
        name = true_label(instance, self.labels, self.ooi, self._is_instance_of, self.also)
        return -1 if name is None else self._channels.index(name)

    def _is_vague(self, k: int) -> bool:
        channel = self._truth[k]
        return channel < 0 or is_vague(self._channels[channel])

    def _wrong_channels(self) -> Float64Array:
        """Return the weights of wrong labels for each instance: (I, C), 0 for the right channel."""
        instances, common = self._scene.instances, len(self.labels)
        extra = range(common, len(self._channels))
        categories = [
            frozenset(instances[k].category for k in np.flatnonzero(self._truth == j).tolist())
            for j in extra
        ]
        rows = np.empty((len(instances), len(self._channels)), dtype=np.float64)
        own = self._own_names()
        alike = {name: affinity(name, self.labels) for name in {i.category for i in instances}}
        for k, instance in enumerate(instances):
            rows[k, :common] = alike[instance.category]
            if self._truth[k] >= common and instance.category in self.labels:
                rows[k, self.labels.index(instance.category)] = 1.0
            for j, of in zip(extra, categories, strict=True):
                rows[k, j] = ooi_affinity(instance.category, of)
        for j, name in enumerate(self._channels):
            # Keyed by name, so that a label keeps its errors when other labels change.
            draws = self._rng(1, zlib.crc32(name.encode())).gumbel(size=len(instances))
            rows[:, j] *= np.exp(self.config.favourite_sigma * draws)
        rows[own] = 0.0
        return rows / np.maximum(rows.sum(axis=1, keepdims=True), 1e-12)

    def _own_names(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        known = np.flatnonzero(self._truth >= 0)
        return known, self._truth[known]

    def _ranges(
        self, depth: Float32Array, centre: Int32Array, pixels: NDArray[np.int64]
    ) -> Float64Array:
        """Return the mean depth of each visible instance."""
        h, w = centre.shape
        v = (np.arange(h) + 0.5) * (depth.shape[0] / h)
        u = (np.arange(w) + 0.5) * (depth.shape[1] / w)
        z = depth[v.astype(np.int64)[:, None], u.astype(np.int64)]
        z = np.where(z > 0.0, z, _BEYOND_RANGE_M)
        total = np.bincount(centre.ravel(), weights=z.ravel(), minlength=len(pixels))
        return total / np.maximum(pixels, 1)

    def _shares(
        self,
        seen: Int32Array,
        ranges: Float64Array,
        camera_position_world: Float64Array,
        frame_index: int,
    ) -> tuple[Float64Array, Float64Array]:
        """Return the right label's share where the image is good and where it is bad."""
        config = self.config
        smooth, _, _ = self._smooth.at(frame_index)
        white = self._rng(2, frame_index).standard_normal(len(self._stable))
        flicker = 0.8 * smooth + 0.6 * white
        logit = (
            config.confidence
            + self._bias[seen]
            + config.stable_sigma * self._stable[seen]
            + config.view_sigma * self._side(seen, camera_position_world)
            + config.flicker_sigma * flicker[seen]
            - config.range_loss_per_m * np.maximum(ranges - config.clear_range_m, 0.0)
        )
        known = (seen >= 0) & (self._truth[seen] >= 0)
        good = np.where(known, sigmoid(logit + config.field_sigma), 0.0)
        bad = np.where(known, sigmoid(logit - config.field_sigma), 0.0)
        return good, bad

    def _side(self, seen: Int32Array, camera_position_world: Float64Array) -> Float64Array:
        """Interpolate the errors for the side of each instance that is in view."""
        offset = camera_position_world[:2] - self._centres[seen, :2]
        turn = np.arctan2(offset[:, 1], offset[:, 0]) / (2.0 * math.pi) * _AZIMUTHS
        lower = np.floor(turn).astype(np.int64)
        part = turn - lower
        first = self._sides[seen, lower % _AZIMUTHS]
        second = self._sides[seen, (lower + 1) % _AZIMUTHS]
        return mixed(first, second, part)

    def _weights(self, seen: Int32Array, shares: Float64Array, frame_index: int) -> Float64Array:
        """Return the visibility of each instance; small ones blend into their surroundings."""
        if self.config.missed_share == 0.0:
            return np.ones(len(seen))
        white = self._rng(3, frame_index).standard_normal(len(self._stable))
        logit = 2.0 * np.log(np.maximum(shares, 1e-9) / self.config.missed_share)
        logit += 0.8 * self._missed[seen] + 0.8 * white[seen]
        return np.where(seen >= 0, sigmoid(logit), 1.0)

    def _rows(self, seen: Int32Array, share: Float64Array, frame_index: int) -> Float64Array:
        """Return the probability vector of each instance from its right label's share."""
        _, _, wobble = self._smooth.at(frame_index)
        wrong = self._lookalikes[seen] * np.exp(self.config.flicker_sigma * wobble[seen])
        wrong /= np.maximum(wrong.sum(axis=1, keepdims=True), 1e-12)
        wrong = (1.0 - self.config.haze) * wrong + self.config.haze / wrong.shape[1]
        wrong[seen < 0] = 1.0 / wrong.shape[1]
        rows = (1.0 - share)[:, None] * wrong
        known = np.flatnonzero((seen >= 0) & (self._truth[seen] >= 0))
        rows[known, self._truth[seen[known]]] += share[known]
        return rows

    def _rng(self, *stream: int) -> np.random.Generator:
        return np.random.Generator(np.random.PCG64([self._seed, *stream]))
