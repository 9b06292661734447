"""Labels for what is in no vocabulary, so that it is not taken for the object of interest."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.observation import Heatmap
from ippon.observation_model import LEAST_SCORE, NOTHING_SAID
from ippon.segmentation.segmenter import MAX_LABELS, DenseSegmenter, checked_channels

DISTRACTORS: Final[tuple[tuple[str, ...], ...]] = (
    ("button", "push_button", "emergency_button"),
    ("light_switch", "power_outlet", "socket"),
    ("thermostat", "smoke_detector", "alarm"),
    ("door_handle", "knob", "hook", "hinge"),
    ("sign", "label", "sticker", "poster"),
    ("cable", "wire", "extension_cord"),
    ("pipe", "valve", "radiator", "heater"),
    ("vent", "fan", "air_conditioner"),
    ("bottle", "flask", "jar"),
    ("cup", "mug", "glass"),
    ("bowl", "plate", "dish", "pan", "pot"),
    ("box", "carton", "package", "basket", "bin"),
    ("bag", "backpack", "handbag", "suitcase"),
    ("book", "magazine", "newspaper", "notebook"),
    ("paper", "card", "envelope"),
    ("pen", "pencil", "marker"),
    ("phone", "remote_control", "tablet", "laptop", "keyboard", "computer_mouse"),
    ("lamp", "candle", "lantern"),
    ("vase", "sculpture", "ornament"),
    ("clock", "watch"),
    ("shoe", "boot", "slipper"),
    ("hat", "cap", "scarf", "glove"),
    ("toy", "ball", "doll", "teddy_bear"),
    ("tool", "screwdriver", "hammer", "wrench", "scissors"),
    ("fire_extinguisher", "hose"),
    ("umbrella", "broom", "mop", "bucket"),
    ("pillow", "blanket", "rug"),
    ("fruit", "food", "snack"),
    ("soap", "toothbrush", "tissue"),
    ("key", "wallet", "coin"),
)
"""Groups of small things that homes and offices hold, each of things that one might call alike."""
CATCH_ALL: Final = ("objects", "others", "object", "other")
"""Common labels that mean 'something else', in the order of choice."""


class DistractorSegmenter:
    """Asks another segmenter for more labels than it was asked for, and hands none of them on.

    An open-vocabulary network must divide each pixel among the labels it is given. Something that
    fits none of them well goes to the one that fits least badly, which may be the object of
    interest: the paper's robot took a yellow button for a screwdriver. Here the button has its own
    label; what falls to it is handed on as 'objects' or 'others' where the vocabulary has such a
    label, else to all common labels alike, which teaches a Bayes filter nothing about which.
    """

    def __init__(
        self, segmenter: DenseSegmenter, groups: Sequence[Sequence[str]] = DISTRACTORS
    ) -> None:
        self._segmenter = segmenter
        self._groups = tuple(tuple(group) for group in groups)

    def segment(self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None) -> Heatmap:
        """Tell how probable each label is at each pixel; see `Segmenter.segment`."""
        checked_channels(color, labels, ooi)
        added = self.distractors(labels, ooi)
        if not added:
            return self._segmenter.segment(color, labels, ooi)
        heatmap = self._segmenter.segment(color, (*labels, *added), ooi)
        return folded(heatmap, len(labels))

    def distractors(self, labels: Sequence[str], ooi: str | None) -> tuple[str, ...]:
        """Return the labels to add: of groups that could not be what is asked for."""
        asked = {word for label in (*labels, ooi or "") for word in _words(label)}
        free = [
            label
            for group in self._groups
            if asked.isdisjoint(word for label in group for word in _words(label))
            for label in group
        ]
        return tuple(free[: max(0, MAX_LABELS - 1 - len(labels))])


def folded(heatmap: Heatmap, count: int) -> Heatmap:
    """Hand what fell to the labels after the first `count` on to those.

    Of scores, those that a label to be left out exceeds say nothing; a catch-all label takes its.

    Args:
        heatmap: With at least one label more than `count`.
        count: Labels to keep.

    Returns:
        A heatmap of the kept labels and the object of interest; sums of probabilities stay.
    """
    kept = heatmap.labels[:count]
    p = heatmap.probabilities
    if heatmap.kind == "scores":
        return replace(heatmap, labels=kept, probabilities=_outdone(heatmap, count))
    extra = p[..., count : len(heatmap.labels)].sum(axis=2, dtype=np.int64)
    common = p[..., :count].astype(np.int64)
    into = next((kept.index(name) for name in CATCH_ALL if name in kept), None)
    if into is not None:
        common[..., into] += extra
    else:
        common += _shared_out(extra, count)
    channels = [common.clip(max=255).astype(np.uint8)]
    if heatmap.ooi is not None and heatmap.ooi not in heatmap.labels:
        channels.append(p[..., -1:])
    return replace(heatmap, labels=kept, probabilities=np.concatenate(channels, axis=2))


def _outdone(heatmap: Heatmap, count: int) -> NDArray[np.uint8]:
    """Return the scores of the kept labels, without those that another label exceeds."""
    p, kept = heatmap.probabilities, heatmap.labels[:count]
    others = p[..., count : len(heatmap.labels)].max(axis=2, keepdims=True)
    scores = np.concatenate([p[..., :count], p[..., len(heatmap.labels) :]], axis=2)
    scores = np.where((scores >= LEAST_SCORE) & (scores < others), np.uint8(NOTHING_SAID), scores)
    into = next((kept.index(name) for name in CATCH_ALL if name in kept), None)
    if into is not None:
        scores[..., into] = np.maximum(p[..., into], others[..., 0])
    return scores


def _shared_out(amounts: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Divide (h, w) whole amounts into (h, w, count) whole parts, as equal as can be."""
    steps = np.arange(count + 1)
    return np.diff(amounts[..., None] * steps // count, axis=2)


def _words(label: str) -> list[str]:
    """Split a label, without the plural's s: `coffee_mugs` is a mug."""
    return [word.removesuffix("s") for word in label.split("_") if word]
