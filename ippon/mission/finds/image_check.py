"""Check of a candidate against the images that show it.

The filter treats images as independent (Sec. Object Probability Mapping), but the errors of a
network are not: an object that is misclassified once is misclassified again from the same view, and
a few such images raise the posterior to nearly 1. Therefore the images vote before a search ends.

An image of a network that labels pixels votes with the share of the candidate's pixels whose most
probable label is the object. An image of a detector votes with 1 if it recognises the object at any
part of the candidate, and with 0 otherwise: an instance is recognised as a whole, but its box
covers other pixels from each view, so that the map spreads it over voxels that no single image
recognises together.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.frame import Frame
from ippon.geometry import Float64Array, invert_transform, transform_points
from ippon.mission.finds.recognised_points import points_at, recognised_points
from ippon.mission.snapshot import Find
from ippon.observation_model import NOTHING_SAID, ObservationModels


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageCheckConfig:
    """Share of a find's pixels that must look like the object before a search ends.

    A larger share ends fewer searches at the wrong object and rejects more correct finds that are
    hard to recognise.
    """

    least_share: float = 0.45
    """Share for a find whose posterior is sure."""
    least_share_small: float = 0.3
    """Share for a find of up to `outline_voxels`, if pixels are labelled: most of its pixels lie on
    its outline, where labels mix."""
    outline_voxels: float = 9.0
    """Size of such a find, in voxels of 10 cm; more applies the lower share to larger finds."""
    unsure_share: float = 0.52
    """Share for a find whose posterior is below `sure`."""
    elsewhere_share: float = 0.45
    """Share for a find that is not where the operator said; more trusts the operator over the
    images."""
    reconsidered_share: float = 0.2
    """Share for a find that was set aside before, once no better one is left; more reports more
    often that nothing was found."""
    single_voxel_share: float = 0.5
    """Share from which less than T_min voxels of a small object suffice; above 1 they never do."""
    sure: float = 0.99
    """Mean p(v in O) from which the posterior of a find is sure; more doubts more finds."""
    images: int = 40
    """Images that shares are averaged over, about those of one approach; more changes the average
    later."""
    min_images: int = 8
    """Images that must show a find before its share counts, and further images of a find that would
    be set aside; more decides later."""
    wait_s: float = 90.0
    """Seconds of robot time in front of a find after which it is judged by fewer images; more waits
    longer for a slow network."""
    max_tracks: int = 6
    """Candidates that are tracked: this many of the largest, and as many others in view; more takes
    longer."""
    same_m: float = 0.6
    """Distance within which the centre of a candidate may move from image to image; more merges
    neighbouring candidates."""
    depth_tolerance_m: float = 0.2
    """Difference between a voxel's depth and that of the image up to which the voxel is visible;
    more counts voxels behind the surface."""

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
        if self.max_tracks < 1 or min(self.same_m, self.depth_tolerance_m) <= 0.0:
            raise ValueError(
                "max_tracks must be at least 1, same_m and depth_tolerance_m above 0; got "
                f"{self.max_tracks}, {self.same_m}, {self.depth_tolerance_m}"
            )
        if not self.wait_s > 0.0:
            raise ValueError(f"wait_s must be positive; got {self.wait_s}")
        if not self.single_voxel_share > 0.0:
            raise ValueError(f"single_voxel_share must be positive; got {self.single_voxel_share}")


@dataclass(slots=True, kw_only=True)
class _Track:
    centre: Float64Array
    shares: deque[float]
    """Votes of the last images that showed it, oldest first."""
    by_instance: bool
    """The votes are those of a detector."""
    points: deque[Float64Array]
    """(M, 2) where each of its last images recognised it, oldest first, metres."""
    last_image: int = 0
    """Number of the last image that showed it; 0 for none."""


class ImageScore(NamedTuple):
    """The score of a find by its images, and the terms of which it consists."""

    all_images: float
    """Mean share of all images."""
    last_images: float
    """Mean share of the last `min_images`: from nearby an object is recognised more often."""
    needed: float
    """The share that such a find needs."""
    by_instance: bool = False
    """The votes are those of a detector."""

    @property
    def margin(self) -> float:
        """The share beyond the needed one; negative where the images contradict the find.

        The last images count as much as all images together: those of a detector for and against
        the find, since it misses few objects that are near; labels of pixels only for it.
        """
        combined = 0.5 * (self.all_images + self.last_images)
        share = combined if self.by_instance else max(self.all_images, combined)
        return share - self.needed


class ImageCheck:
    """Tracks the candidates from image to image, and scores each by the images that show it.

    Args:
        config: Shares that finds need.
        label: The object's label in the heatmaps.
        outline_voxels: Voxels up to which a find is mostly outline; 0 for large objects.
        models: Observation models of the networks; None for the defaults.
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
        self.images = 0
        """Images that were compared with candidates so far."""

    def observe(self, frame: Frame, centres_world: Float64Array, finds: Sequence[Find]) -> None:
        """Add the votes of an image.

        Args:
            frame: An image without a heatmap of the object is ignored.
            centres_world: (M, 3) centres of OOI voxels, metres.
            finds: Their clusters, largest first.
        """
        heatmap = frame.heatmap
        if heatmap is None or heatmap.channel_of(self._label) is None or not len(centres_world):
            return
        seen, wins = votes(
            frame, self._label, centres_world, self._models, self._config.depth_tolerance_m
        )
        self.images += 1
        by_instance = heatmap.kind == "scores"
        recognised = np.zeros((0, 3))
        if by_instance:
            recognised = recognised_points(frame, self._label, self._models)
        kept: list[_Track] = []
        # Smaller candidates in view are tracked as well, since each may end the search.
        most = self._config.max_tracks
        in_view = [find for find in finds[most:] if find.box_px is not None]
        for find in (*finds[:most], *in_view[:most]):
            centre = np.array(find.position_world)
            track = self._of(find)
            if track is None or track.by_instance != by_instance:
                shares = deque[float](maxlen=self._config.images)
                points = deque[Float64Array](maxlen=self._config.min_images)
                track = _Track(centre=centre, shares=shares, by_instance=by_instance, points=points)
            track.centre = centre
            here = points_at(recognised, find, self._config.same_m)
            if len(here):
                track.points.append(here)
            inside = np.abs(centres_world - track.centre) <= 0.5 * np.array(find.size_m) + 1e-6
            mine = inside.all(axis=1) & seen
            if mine.any():
                votes_for = wins[mine]
                track.shares.append(float(votes_for.any() if by_instance else votes_for.mean()))
                track.last_image = self.images
            kept.append(track)
        self._tracks = kept

    def share(self, find: Find) -> float | None:
        """Return the mean share of a find's images; None with fewer than `min_images`."""
        track = self._track_with_enough(find)
        return None if track is None else float(np.mean(track.shares))

    def last_image_of(self, find: Find) -> int:
        """Return the number, as in `images`, of the last image that showed a find; 0 for none."""
        track = self._of(find)
        return 0 if track is None else track.last_image

    def recognised_at(self, find: Find) -> tuple[Float64Array, ...]:
        """Return where each of the last images of a detector recognised a find.

        Returns:
            (M, 2) world x and y of points on the surface, metres, for each image that shows it.
        """
        track = self._of(find)
        return () if track is None else tuple(track.points)

    def score(
        self, find: Find, *, again: bool = False, elsewhere: bool = False
    ) -> ImageScore | None:
        """Return the score of a find by its images.

        Args:
            find: A candidate.
            again: It was set aside before.
            elsewhere: It is not where the operator said.

        Returns:
            None if too few images show it.
        """
        track = self._track_with_enough(find)
        if track is None:
            return None
        last = list(track.shares)[-self._config.min_images :]
        outline = not track.by_instance and find.voxels <= self._outline_voxels
        return ImageScore(
            all_images=float(np.mean(track.shares)),
            last_images=float(np.mean(last)),
            needed=self._needed_share(find, outline=outline, again=again, elsewhere=elsewhere),
            by_instance=track.by_instance,
        )

    def contradicts(self, find: Find, *, again: bool = False, elsewhere: bool = False) -> bool:
        """Return whether the images contradict a find; see `ImageScore.margin`."""
        score = self.score(find, again=again, elsewhere=elsewhere)
        return score is not None and score.margin < 0.0

    def is_sure(self, find: Find) -> bool:
        """Return whether the posterior of a find is sure."""
        return find.probability >= self._config.sure

    def confirms(self, find: Find) -> bool:
        """Return whether posterior and images both confirm a find, regardless of its size."""
        share = self.share(find)
        return self.is_sure(find) and share is not None and share >= self._config.single_voxel_share

    def _track_with_enough(self, find: Find) -> _Track | None:
        """Return the track of a find that at least `min_images` have shown."""
        track = self._of(find)
        if track is None or len(track.shares) < self._config.min_images:
            return None
        return track

    def _needed_share(self, find: Find, *, outline: bool, again: bool, elsewhere: bool) -> float:
        config = self._config
        if outline:
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
        close = nearest is not None and math.dist(nearest.centre, at) <= self._config.same_m
        return nearest if close else None


def votes(
    frame: Frame,
    label: str,
    centres_world: Float64Array,
    models: ObservationModels,
    depth_tolerance_m: float,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which voxels an image shows, and which of them look like the object.

    Args:
        frame: With a heatmap that has a channel for the object.
        label: The object's label in it.
        centres_world: (M, 3) centres of voxels, metres.
        models: Observation models of the networks.
        depth_tolerance_m: See `ImageCheckConfig.depth_tolerance_m`.

    Returns:
        (M,) whether the image shows each voxel, and (M,) whether it looks like the object there. A
        voxel without a score does not count as shown.
    """
    heatmap, camera = frame.heatmap, frame.camera
    seen = np.zeros(len(centres_world), dtype=np.bool_)
    wins = np.zeros(len(centres_world), dtype=np.bool_)
    channel = None if heatmap is None else heatmap.channel_of(label)
    if heatmap is None or channel is None:
        return seen, wins
    points = transform_points(invert_transform(frame.T_world_camera), centres_world)
    at = np.flatnonzero(points[:, 2] > 0.1)
    u, v = (np.floor(pixel + 0.5) for pixel in camera.project(points[at]))
    inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
    at, u, v = at[inside], u[inside].astype(np.int64), v[inside].astype(np.int64)
    shown = np.abs(frame.depth[v, u] - points[at, 2]) <= depth_tolerance_m
    at, u, v = at[shown], u[shown], v[shown]
    rows, columns = heatmap.probabilities.shape[:2]
    pixel = heatmap.probabilities[v * rows // camera.height, u * columns // camera.width]
    if heatmap.kind == "distribution":
        seen[at] = True
        wins[at] = pixel.argmax(axis=1) == channel
    else:
        score = pixel[:, channel]
        table = models.of(heatmap).table_of(label)
        seen[at] = score != NOTHING_SAID
        wins[at] = table.log_ratios("scores")[score] > 0.0
        wins &= seen
    return seen, wins
