"""Whether what the map takes for the object looks like it in the images, too.

The filter takes every image for a new piece of evidence (Sec. Object Probability Mapping), but an
object that is misread is misread again and again: a few unlucky images are enough for p near 1, and
of a window that was taken for a television once, hardly an image says so again. So before a search
ends, the images are asked how often what they show of it wins against every other label.
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

_FOLLOWED = 6
"""Clusters that are followed at a time: so many of the largest, and as many others in view."""
_SAME_M = 0.6
_BEHIND_M = 0.2
"""Depth by which a voxel may differ from the image and still be what it shows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondLookConfig:
    """When the images speak against a find."""

    least_share: float = 0.45
    """Share of a find's pixels whose likeliest label is the object, on the average of the last
    images; more sends the robot on from more wrong finds, and from right ones that are badly
    recognised. Of 133 right finds one had less than 0.48, wrong ones 0.15 to 0.6."""
    least_share_small: float = 0.3
    """Likewise for things that fill a voxel or two: most of their pixels are outline, where labels
    mix. Of 33 right finds one had 0.33, the others more; a lamp that was found for a basket
    had 0.27."""
    outline_voxels: float = 9.0
    """Voxels of 10 cm up to which that holds; of larger small things right finds had 0.5 or more,
    shoes that were taken for a hat 0.28."""
    unsure_share: float = 0.52
    """Likewise where the map itself is not sure of the find. Of the right finds with less than 0.6
    none was of that kind, of nine wrong ones seven; more also denies right ones, which costs the
    way back to them."""
    reconsidered_share: float = 0.2
    """Likewise for what was doubted once, when nothing better is left to look at; more would
    rather say that nothing was found."""
    idle_gain: float = 0.3
    """Gain a second, of the best way, below which that is so; 0 waits until nothing at all is left
    to explore. Exploring has 1 to 15, and less than this in the last corners."""
    idle_steps: int = 15
    """So many steps in a row."""
    elsewhere_share: float = 0.45
    """Likewise where the operator said what the object is on or beside, and the find is nowhere
    near one; more believes the operator more than the images."""
    speck_share: float = 0.5
    """Share from which a small thing is taken for found that never shows more than T_min, a bottle
    in a single voxel of 10 cm, where the map is sure of it; above 1 it never is."""
    sure: float = 0.99
    """Mean p(v in O) of a find from which the map is sure; more doubts more finds."""
    images: int = 40
    """Images that it is the average of; the approach takes about as many."""
    enough_images: int = 8
    """A find that fewer have shown is looked at for as many more; after that the map decides. What
    seems to be something else is looked at for as many more, too, and these can save it."""

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
            or not 1 <= self.enough_images <= self.images
        ):
            raise ValueError(
                "least_share, least_share_small, unsure_share, elsewhere_share, "
                "reconsidered_share and sure must lie in [0, 1] and enough_images in 1 to images; "
                f"got {shares}, {self.enough_images}, {self.images}"
            )
        if not self.outline_voxels >= 0.0:
            raise ValueError(f"outline_voxels must not be negative; got {self.outline_voxels}")
        if self.idle_gain < 0.0 or self.idle_steps < 1 or not self.speck_share > 0.0:
            raise ValueError(
                "idle_gain must not be negative, idle_steps at least 1 and speck_share positive; "
                f"got {self.idle_gain}, {self.idle_steps}, {self.speck_share}"
            )


@dataclass(slots=True, kw_only=True)
class _Followed:
    centre: Float64Array
    shares: deque[float]
    """Of the last images that showed it."""


class SecondLook:
    """Follows the clusters that may be the object from image to image.

    Args:
        config: When the images speak against a find.
        label: The object, as the heatmaps call it.
        outline_voxels: Voxels up to which a find is mostly outline; 0 for what is large.
    """

    def __init__(self, config: SecondLookConfig, label: str, *, outline_voxels: float) -> None:
        self._config = config
        self._outline_voxels = outline_voxels
        self._label = label
        self._followed: list[_Followed] = []

    def note(self, frame: Frame, centres_world: Float64Array, finds: Sequence[Find]) -> None:
        """Ask an image.

        Args:
            frame: The image; one without a heatmap of the object says nothing.
            centres_world: (M, 3) voxels that the map takes for the object, metres.
            finds: Their clusters, largest first.
        """
        heatmap = frame.heatmap
        if heatmap is None or heatmap.ooi != self._label or not len(centres_world):
            return
        seen, wins = votes(frame, centres_world)
        kept: list[_Followed] = []
        # What is in view is followed however small it is, or nothing could be said of it.
        in_view = [find for find in finds[_FOLLOWED:] if find.box_px is not None]
        for find in (*finds[:_FOLLOWED], *in_view[:_FOLLOWED]):
            centre = np.array(find.position_world)
            one = self._of(find)
            if one is None:
                one = _Followed(centre=centre, shares=deque(maxlen=self._config.images))
            one.centre = centre
            inside = np.abs(centres_world - one.centre) <= 0.5 * np.array(find.size_m) + 1e-6
            mine = inside.all(axis=1) & seen
            if mine.any():
                one.shares.append(float(wins[mine].mean()))
            kept.append(one)
        self._followed = kept

    def share(self, find: Find) -> float | None:
        """Return how often a find looks like the object; None where too few images tell."""
        one = self._of(find)
        if one is None or len(one.shares) < self._config.enough_images:
            return None
        return float(np.mean(one.shares))

    def contradicts(self, find: Find, *, again: bool = False, elsewhere: bool = False) -> bool:
        """Tell whether the images speak against a find: all of them, and those from nearby no less.

        From afar much that is the object does not look like it. So where the last images say more
        for it than all together, they count as much as these.

        Args:
            find: What the map takes for the object.
            again: They did before.
            elsewhere: It is not where the operator said.
        """
        share = self.share(find)
        least = self._least_share(find)
        if elsewhere:
            least = max(least, self._config.elsewhere_share)
        if again:
            least = min(least, self._config.reconsidered_share)
        return share is not None and max(share, 0.5 * (share + self._last_share(find))) < least

    def is_sure(self, find: Find) -> bool:
        """Tell whether the map is sure of a find."""
        return find.probability >= self._config.sure

    def confirms(self, find: Find) -> bool:
        """Tell whether map and images are both sure of a find, however little it is."""
        share = self.share(find)
        return self.is_sure(find) and share is not None and share >= self._config.speck_share

    def _last_share(self, find: Find) -> float:
        one = self._of(find)
        last = [] if one is None else list(one.shares)[-self._config.enough_images :]
        return sum(last) / max(1, len(last))

    def _least_share(self, find: Find) -> float:
        config = self._config
        if find.voxels <= self._outline_voxels:
            return config.least_share_small
        if self.is_sure(find):
            return config.least_share
        return max(config.least_share, config.unsure_share)

    def _of(self, find: Find) -> _Followed | None:
        at = find.position_world
        nearest = min(self._followed, key=lambda one: math.dist(one.centre, at), default=None)
        return nearest if nearest is None or math.dist(nearest.centre, at) <= _SAME_M else None


def votes(frame: Frame, centres_world: Float64Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Look voxels up in the image.

    Args:
        frame: With a heatmap that was asked for the object.
        centres_world: (M, 3) metres.

    Returns:
        (M,) whether the image shows the voxel, and (M,) whether it takes it for the object there.
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
    seen[at] = True
    rows, columns = heatmap.probabilities.shape[:2]
    pixel = heatmap.probabilities[v * rows // camera.height, u * columns // camera.width]
    wins[at] = pixel.argmax(axis=1) == heatmap.ooi_channel
    return seen, wins
