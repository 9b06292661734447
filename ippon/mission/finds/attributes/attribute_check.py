"""Judgement of a find's attributes: its colour by the images, its size by the map.

Each image gives the share of the find's pixels that have the named colour; the median over the
images decides. Attributes of other kinds are judged by a vision-language model, if there is one.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ippon.frame import Frame
from ippon.geometry import invert_transform, transform_points
from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.words import word_set
from ippon.mission.finds.attributes.colour_regions import colour_name, lab_of, region_of
from ippon.mission.snapshot import Find, JudgedAttribute
from ippon.observation_model import NOTHING_SAID, ObservationModels

_USUAL_SHARE: Final = 0.65
"""Longest side of an ordinary specimen, as a share of that of a large one."""
_LARGE: Final = word_set(
    "big large huge giant enormous massive tall long oversized bigger larger taller longer biggest "
    "largest tallest longest bulky full-size"
)
_SMALL: Final = word_set(
    "small little tiny mini short compact smaller shorter smallest shortest wee petite teeny "
    "pocket-sized"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class AttributeCheckConfig:
    """When an attribute counts as right or wrong; between, it is not judged."""

    right_share: float = 0.4
    """Share of a find's pixels with the named colour from which the colour is right; more leaves
    more finds unjudged."""
    wrong_share: float = 0.12
    """Share below which it is wrong; less leaves more finds unjudged."""
    min_images: int = 5
    """Images that a colour needs; more judges later, and fewer finds."""
    images: int = 40
    """Last images that count; more changes the judgement later."""
    min_pixels: int = 12
    """Pixels of the find that an image must show; more ignores more distant views."""
    max_range_m: float = 3.5
    """Distance up to which images count; more counts views with mixed pixels."""
    same_m: float = 0.3
    """Distance that the centre of a find may move between images; more merges neighbours."""
    depth_margin_m: float = 0.12
    """Margin around the find's box in which pixels belong to it; more counts more surroundings."""
    large_ratio: float = 1.2
    """Ratio to the usual size from which an object is large; more calls fewer large."""
    small_ratio: float = 0.7
    """Ratio to the usual size below which an object is small; less calls fewer small."""
    size_voxels: float = 4.0
    """Usual size in voxels from which the map can tell sizes; more leaves more unjudged."""

    def __post_init__(self) -> None:
        """Reject limits that judge an attribute right and wrong."""
        if not 0.0 <= self.wrong_share < self.right_share <= 1.0:
            raise ValueError(
                "shares must grow: 0 <= wrong_share < right_share <= 1; got "
                f"{self.wrong_share}, {self.right_share}"
            )
        if not 0.0 < self.small_ratio < self.large_ratio:
            raise ValueError(
                "ratios must grow: 0 < small_ratio < large_ratio; got "
                f"{self.small_ratio}, {self.large_ratio}"
            )
        if not 1 <= self.min_images <= self.images or self.min_pixels < 1:
            raise ValueError(
                "min_images lies in 1 to images and min_pixels is at least 1; got "
                f"{self.min_images}, {self.images}, {self.min_pixels}"
            )


@dataclass(slots=True)
class _Track:
    centre: tuple[float, float, float]
    shares: deque[tuple[float, ...]]
    """For each image, the share of the find's pixels of each colour that was asked for."""
    names: deque[str]
    """For each image, the colour of most pixels."""


class AttributeCheck:
    """Judges the attributes of a search's candidates.

    Args:
        config: Limits of the judgement.
        label: Canonical label of the object.
        attributes: What was said of it.
        voxel_size_m: Edge of a voxel of the map.
        models: Observation models of the networks; None for the defaults.
    """

    def __init__(
        self,
        config: AttributeCheckConfig,
        label: str,
        attributes: Sequence[Attribute],
        voxel_size_m: float,
        models: ObservationModels | None = None,
    ) -> None:
        self._config = config
        self._label = label
        self._attributes = tuple(attributes)
        self._voxel_m = voxel_size_m
        self._models = models or ObservationModels()
        named = {one.value: region_of(one.value) for one in attributes if one.kind == "colour"}
        self._regions = {name: region for name, region in named.items() if region is not None}
        self._tracks: list[_Track] = []

    def observe(self, frame: Frame, finds: Sequence[Find]) -> None:
        """Add the colours that an image shows of the candidates.

        Args:
            frame: The image; without a heatmap of the object it is ignored.
            finds: The candidates, with boxes in this image.
        """
        if not self._regions:
            return
        for find in finds:
            pixels = self._pixels(frame, find)
            if pixels is None:
                continue
            lab = lab_of(pixels)
            track = self._of(find)
            if track is None:
                size = self._config.images
                track = _Track(find.position_world, deque(maxlen=size), deque(maxlen=size))
                self._tracks.append(track)
            track.centre = find.position_world
            track.shares.append(
                tuple(float(one.contains(lab).mean()) for one in self._regions.values())
            )
            track.names.append(colour_name(lab))

    def judge(self, find: Find, others: Sequence[Find] = ()) -> tuple[JudgedAttribute, ...]:
        """Return what was said of the object, each judged on a find.

        Args:
            find: The find.
            others: Other instances of the object, to compare sizes with.
        """
        judged: list[JudgedAttribute] = []
        for one in self._attributes:
            said = JudgedAttribute(value=one.value, kind=one.kind, negated=one.negated)
            if one.kind == "colour":
                said = self._judge_colour(said, find)
            elif one.kind == "size":
                said = self._judge_size(said, find, others)
            judged.append(said)
        return tuple(judged)

    def _judge_colour(self, said: JudgedAttribute, find: Find) -> JudgedAttribute:
        track = self._of(find)
        if said.value not in self._regions or track is None:
            return said
        if len(track.shares) < self._config.min_images:
            return said
        column = list(self._regions).index(said.value)
        share = float(np.median([shares[column] for shares in track.shares]))
        seen = max(track.names, key=track.names.count)
        if share >= self._config.right_share:
            return _judged(said, holds=True, by="images", seen=said.value)
        if share <= self._config.wrong_share:
            return _judged(said, holds=False, by="images", seen=seen)
        return replace(said, seen=seen)

    def _judge_size(
        self, said: JudgedAttribute, find: Find, others: Sequence[Find]
    ) -> JudgedAttribute:
        large = said.value in _LARGE
        if not large and said.value not in _SMALL:
            return said
        longest = max(find.size_m)
        if others:
            usual = float(np.median([max(one.size_m) for one in others]))
            by = "comparison with the others"
        else:
            usual = _USUAL_SHARE * load_knowledge().size_m(self._label)
            by = "its usual size"
        if not math.isfinite(usual) or usual < self._config.size_voxels * self._voxel_m:
            return said
        ratio = longest / usual
        if ratio >= self._config.large_ratio:
            return _judged(said, holds=large, by=by, seen="large")
        if ratio <= self._config.small_ratio:
            return _judged(said, holds=not large, by=by, seen="small")
        return said

    def _pixels(self, frame: Frame, find: Find) -> NDArray[np.uint8] | None:
        """Return the (N, 3) pixels that show a find, without its outline; None for too few."""
        heatmap, config = frame.heatmap, self._config
        channel = None if heatmap is None else heatmap.channel_of(self._label)
        if heatmap is None or channel is None:
            return None
        middle, half = np.array(find.position_world), 0.5 * np.array(find.size_m)
        corners = np.array(list(product(*zip(middle - half, middle + half, strict=True))))
        points = transform_points(
            invert_transform(frame.T_world_camera), np.vstack([middle, corners])
        )
        away = float(points[0, 2])
        if points[:, 2].min() <= 0.1 or away > config.max_range_m:
            return None
        u, v = frame.camera.project(points[1:])
        u0, u1 = max(int(u.min()), 0), min(int(u.max()) + 1, frame.camera.width)
        v0, v1 = max(int(v.min()), 0), min(int(v.max()) + 1, frame.camera.height)
        if u0 >= u1 or v0 >= v1:
            return None
        v, u = np.mgrid[v0:v1, u0:u1]
        rows, columns = heatmap.probabilities.shape[:2]
        height, width = frame.color.shape[:2]
        at = heatmap.probabilities[v * rows // height, u * columns // width]
        if heatmap.kind == "distribution":
            shown = at.argmax(axis=2) == channel
        else:
            table = self._models.of(heatmap).table_of(self._label)
            score = at[..., channel]
            shown = (score != NOTHING_SAID) & (table.log_ratios("scores")[score] > 0.0)
        reach = 0.5 * math.hypot(*find.size_m) + config.depth_margin_m
        shown &= np.abs(frame.depth[v, u] - away) <= reach
        inner = np.asarray(ndimage.binary_erosion(shown))
        shown = inner if inner.sum() >= config.min_pixels else shown
        pixels = frame.color[v[shown], u[shown]]
        return pixels if len(pixels) >= config.min_pixels else None

    def _of(self, find: Find) -> _Track | None:
        at = find.position_world
        nearest = min(self._tracks, key=lambda one: math.dist(one.centre, at), default=None)
        close = nearest is not None and math.dist(nearest.centre, at) <= self._config.same_m
        return nearest if close else None


def by_model(
    judged: Sequence[JudgedAttribute], verdict: str, name: str
) -> tuple[JudgedAttribute, ...]:
    """Return attributes after a vision-language model's answer about the object with all of them.

    Whose it is stays unchecked: no image shows it.

    Args:
        judged: The attributes.
        verdict: Its answer; a "no" may be about the object itself and judges no attribute.
        name: Of the model.
    """
    if verdict != "yes":
        return tuple(judged)
    return tuple(
        replace(one, verdict="right", by=name)
        if one.verdict == "unchecked" and one.kind != "owner"
        else one
        for one in judged
    )


def contradiction(judged: Sequence[JudgedAttribute], name: str) -> str | None:
    """Return what a find is instead, "a mug, but it is white"; None if no attribute is wrong.

    Args:
        judged: Its attributes.
        name: The kind of object, in words.
    """
    wrong = [one for one in judged if one.verdict == "wrong"]
    if not wrong:
        return None
    parts = [one.seen if one.seen and not one.negated else one.denied_text for one in wrong]
    is_so = " and it is ".join(parts)
    return f"a{'n' if name[:1] in 'aeiou' else ''} {name}, but it is {is_so}"


def attributes_text(judged: Sequence[JudgedAttribute]) -> str:
    """Return which attributes were checked and which not; empty without attributes."""
    right = [one.text for one in judged if one.verdict == "right"]
    unchecked = [
        one.kind if one.kind in ("colour", "size", "material", "pattern") else f"“{one.text}”"
        for one in judged
        if one.verdict == "unchecked"
    ]
    parts = [
        f"{', '.join(right)}: checked" if right else "",
        f"{', '.join(dict.fromkeys(unchecked))} not checked" if unchecked else "",
    ]
    return "; ".join(filter(None, parts))


def seen_attributes(judged: Sequence[JudgedAttribute]) -> tuple[str, ...]:
    """Return what was seen of a thing, in words: "red" where that was said, or "white" instead."""
    right = (one.text if one.verdict == "right" else "" for one in judged)
    instead = (one.seen if one.verdict == "wrong" and not one.negated else "" for one in judged)
    return tuple(dict.fromkeys(filter(None, (*right, *instead))))


def _judged(said: JudgedAttribute, *, holds: bool, by: str, seen: str) -> JudgedAttribute:
    verdict = "right" if holds != said.negated else "wrong"
    return replace(said, verdict=verdict, by=by, seen=seen)
