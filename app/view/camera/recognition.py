"""What the network sees in an image: the heat of one label, or the boxes of a detector."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.messages.perception.detections import StampedBoxes
from app.view.camera.overlays import ImageLine
from app.view.camera.picture_encoding import turned
from app.view.words import Words
from ippon.camera import PinholeCamera
from ippon.observation import Heatmap

BOXES: Final = 12
"""Most boxes that are drawn."""
LEAST_SCORE: Final = 0.2


def heat_of(heatmap: Heatmap, label: str) -> NDArray[np.uint8] | None:
    """Return (h, w) uint8 of one label; None if the network does not tell it apart.

    Args:
        heatmap: Output of the network.
        label: A label with spaces or underscores; empty for the object of interest.
    """
    if not label:
        channel = heatmap.ooi_channel
        return None if channel is None else heatmap.probabilities[:, :, channel]
    names = [_plain(name) for name in heatmap.labels]
    if heatmap.ooi is not None and _plain(label) == _plain(heatmap.ooi):
        return heat_of(heatmap, "")
    if _plain(label) not in names:
        return None
    return heatmap.probabilities[:, :, names.index(_plain(label))]


def labels_of(heatmap: Heatmap) -> list[str]:
    """Return the labels that can be chosen, with spaces, in alphabetical order."""
    return sorted({_plain(name) for name in heatmap.labels})


def boxes_of(
    boxes: StampedBoxes, camera: PinholeCamera, label: str, turns: int, say: Words
) -> list[ImageLine]:
    """Return the outlines of a detector's boxes.

    Args:
        boxes: Output of the detector.
        camera: Size of the image.
        label: Only boxes of this label; empty for all.
        turns: Quarter turns counterclockwise of the picture.
        say: The words of the names.
    """
    lines: list[ImageLine] = []
    wanted = _plain(label)
    for box, score, name in zip(boxes.boxes_px, boxes.scores.tolist(), boxes.names, strict=True):
        if not (score >= LEAST_SCORE and np.isfinite(box).all()):
            continue
        if wanted and _plain(name) != wanted:
            continue
        x0, y0, x1, y1 = np.clip(
            box / [camera.width, camera.height, camera.width, camera.height], 0.0, 1.0
        ).tolist()
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
        points = [turned(x, y, turns) for x, y in corners]
        lines.append(
            ImageLine(
                kind="seen", points=points, text=f"{say.name(_plain(name))} {say.percent(score)}"
            )
        )
        if len(lines) == BOXES:
            break
    return lines


def _plain(name: str) -> str:
    return name.replace("_", " ").strip().lower()
