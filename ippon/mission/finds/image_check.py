"""Whether a candidate looks like the object in the images, too.

The filter treats images as independent (Sec. Object Probability Mapping), but the errors of a
network are not: an object that is misread once is misread again from the same view, and a few such
images raise the posterior near 1. Before a search ends, the images vote: how often is the object
the most probable label of the candidate's pixels, or, with a network that scores each label by
itself, how often does its score speak for it?
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ippon.frame import Frame
from ippon.geometry import Float64Array, invert_transform, transform_points
from ippon.mission.snapshot import Find
from ippon.observation_model import NOTHING_SAID, ObservationModels

_MAX_TRACKS = 6
"""Candidates that are tracked: this many of the largest, and as many others in view."""
_SAME_M = 0.6
_BEHIND_M = 0.2
"""A voxel is visible where its depth differs from the image by no more than this."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageCheckConfig:
    """Share of a find's pixels that must look like the object before a search ends.

    A pixel looks like the object where the object is its most probable label or, with a network
    that scores each label by itself, where the object's score speaks for it. A larger share ends
    fewer searches at the wrong object, and leaves more right ones that are hard to recognise.
    """

    least_share: float = 0.45
    """For a find whose posterior is sure."""
    least_share_small: float = 0.3
    """For a find of up to `outline_voxels`: most of its pixels are outline, where labels mix."""
    outline_voxels: float = 9.0
    """Size of such a find, in voxels of 10 cm; more applies the lower share to larger finds."""
    unsure_share: float = 0.52
    """For a find whose posterior is below `sure`."""
    elsewhere_share: float = 0.45
    """For a find that is not where the operator said; more trusts the operator over the images."""
    reconsidered_share: float = 0.2
    """For a find that was set aside before, when nothing better is left; more prefers to report
    that nothing was found."""
    single_voxel_share: float = 0.5
    """Share from which a small object is confirmed by less than T_min; above 1 it never is."""
    sure: float = 0.99
    """Mean p(v in O) from which the posterior of a find counts as sure; more doubts more finds."""
    images: int = 40
    """Images that shares are averaged over; an approach takes about as many."""
    min_images: int = 8
    """Images that must show a find before its share counts, and extra images for a find that is
    about to be set aside."""

    def __post_init__(self) -> None:
        """Reject shares and counts without meaning."""
        shares = (
            self.least_share,
            self.least_share_small,
            self.unsure_share,
            self.elsewhere_share,
            self.reconsidered_share,
            self.sure,
        )
        if (
            not all(0.0 <= share <= 1.0 for share in shares)
            or not 1 <= self.min_images <= self.images
        ):
            raise ValueError(
                "least_share, least_share_small, unsure_share, elsewhere_share, "
                "reconsidered_share and sure must lie in [0, 1] and min_images in 1 to images; "
                f"got {shares}, {self.min_images}, {self.images}"
            )
        if not self.outline_voxels >= 0.0:
            raise ValueError(f"outline_voxels must not be negative; got {self.outline_voxels}")
        if not self.single_voxel_share > 0.0:
            raise ValueError(f"single_voxel_share must be positive; got {self.single_voxel_share}")


@dataclass(slots=True, kw_only=True)
class _Track:
    centre: Float64Array
    shares: deque[float]
    """Of the last images that showed it, oldest first."""


class ImageCheck:
    """Tracks the candidates from image to image, and keeps the share of each.

    Args:
        config: Shares that finds need.
        label: The object, as the heatmaps call it.
        outline_voxels: Voxels up to which a find is mostly outline; 0 for what is large.
        models: What the scores of networks are worth; without them, the shipped defaults.
    """

    def __init__(
        self,
        config: ImageCheckConfig,
        label: str,
        *,
        outline_voxels: float,
        models: ObservationModels | None = None,
    ) -> None:
        self._config = config
        self._outline_voxels = outline_voxels
        self._label = label
        self._models = models or ObservationModels()
        self._tracks: list[_Track] = []

    def observe(self, frame: Frame, centres_world: Float64Array, finds: Sequence[Find]) -> None:
        """Add the votes of an image.

        Args:
            frame: An image without a heatmap of the object is ignored.
            centres_world: (M, 3) voxels that the map takes for the object, metres.
            finds: Their clusters, largest first.
        """
        heatmap = frame.heatmap
        if heatmap is None or heatmap.ooi != self._label or not len(centres_world):
            return
        seen, wins = votes(frame, centres_world, self._models)
        kept: list[_Track] = []
        # Candidates in view are tracked whatever their size: each may end the search.
        in_view = [find for find in finds[_MAX_TRACKS:] if find.box_px is not None]
        for find in (*finds[:_MAX_TRACKS], *in_view[:_MAX_TRACKS]):
            centre = np.array(find.position_world)
            track = self._of(find)
            if track is None:
                track = _Track(centre=centre, shares=deque(maxlen=self._config.images))
            track.centre = centre
            inside = np.abs(centres_world - track.centre) <= 0.5 * np.array(find.size_m) + 1e-6
            mine = inside.all(axis=1) & seen
            if mine.any():
                track.shares.append(float(wins[mine].mean()))
            kept.append(track)
        self._tracks = kept

    def share(self, find: Find) -> float | None:
        """Return the mean share of a find's images; None with fewer than `min_images`."""
        track = self._of(find)
        if track is None or len(track.shares) < self._config.min_images:
            return None
        return float(np.mean(track.shares))

    def margin(self, find: Find, *, again: bool = False, elsewhere: bool = False) -> float | None:
        """Return by how much the share of a find exceeds the share that it needs.

        An object is recognised less often from afar: where the last images show it more clearly,
        they count as much as all images together.

        Args:
            find: A candidate.
            again: It was set aside before.
            elsewhere: It is not where the operator said.

        Returns:
            Negative where the images contradict the find; None where too few images show it.
        """
        share = self.share(find)
        if share is None:
            return None
        needed = self._needed_share(find, again=again, elsewhere=elsewhere)
        return max(share, 0.5 * (share + self._last_share(find))) - needed

    def contradicts(self, find: Find, *, again: bool = False, elsewhere: bool = False) -> bool:
        """Return whether the images contradict a find; see `margin`."""
        margin = self.margin(find, again=again, elsewhere=elsewhere)
        return margin is not None and margin < 0.0

    def is_sure(self, find: Find) -> bool:
        """Return whether the posterior of a find is sure."""
        return find.probability >= self._config.sure

    def confirms(self, find: Find) -> bool:
        """Return whether posterior and images both confirm a find, whatever its size."""
        share = self.share(find)
        return self.is_sure(find) and share is not None and share >= self._config.single_voxel_share

    def _last_share(self, find: Find) -> float:
        track = self._of(find)
        last = [] if track is None else list(track.shares)[-self._config.min_images :]
        return sum(last) / max(1, len(last))

    def _needed_share(self, find: Find, *, again: bool, elsewhere: bool) -> float:
        config = self._config
        if find.voxels <= self._outline_voxels:
            needed = config.least_share_small
        elif self.is_sure(find):
            needed = config.least_share
        else:
            needed = max(config.least_share, config.unsure_share)
        if elsewhere:
            needed = max(needed, config.elsewhere_share)
        return min(needed, config.reconsidered_share) if again else needed

    def _of(self, find: Find) -> _Track | None:
        at = find.position_world
        nearest = min(self._tracks, key=lambda track: math.dist(track.centre, at), default=None)
        return nearest if nearest is None or math.dist(nearest.centre, at) <= _SAME_M else None


def votes(
    frame: Frame, centres_world: Float64Array, models: ObservationModels
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which voxels an image shows, and which it takes for the object.

    Args:
        frame: With a heatmap that has a channel for the object.
        centres_world: (M, 3) metres.
        models: What scores are worth.

    Returns:
        (M,) whether the image shows each voxel, and (M,) whether it looks like the object. Where
        scores say nothing of the object, the image does not show it.
    """
    heatmap, camera = frame.heatmap, frame.camera
    seen = np.zeros(len(centres_world), dtype=np.bool_)
    wins = np.zeros(len(centres_world), dtype=np.bool_)
    if heatmap is None or heatmap.ooi_channel is None:
        return seen, wins
    points = transform_points(invert_transform(frame.T_world_camera), centres_world)
    at = np.flatnonzero(points[:, 2] > 0.1)
    u, v = (np.floor(pixel + 0.5) for pixel in camera.project(points[at]))
    inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
    at, u, v = at[inside], u[inside].astype(np.int64), v[inside].astype(np.int64)
    shown = np.abs(frame.depth[v, u] - points[at, 2]) <= _BEHIND_M
    at, u, v = at[shown], u[shown], v[shown]
    rows, columns = heatmap.probabilities.shape[:2]
    pixel = heatmap.probabilities[v * rows // camera.height, u * columns // camera.width]
    if heatmap.kind == "distribution":
        seen[at] = True
        wins[at] = pixel.argmax(axis=1) == heatmap.ooi_channel
    else:
        score = pixel[:, heatmap.ooi_channel]
        table = models.of(heatmap).table_of(heatmap.ooi or "")
        seen[at] = score != NOTHING_SAID
        wins[at] = table.log_ratios("scores")[score] > 0.0
        wins &= seen
    return seen, wins
