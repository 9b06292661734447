"""Joins the boxes of a detector with their optional masks."""

from dataclasses import dataclass
from typing import Final

from app.messages.perception.detection_masks import StampedMasks
from app.messages.perception.detections import StampedBoxes

MAX_MASKS: Final = 4
"""Maximum number of masks that wait for their boxes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StampedDetections:
    """Boxes, and masks if any, of a detector on the robot for one image."""

    stamp_ns: int
    boxes: StampedBoxes
    masks: StampedMasks | None


class MaskPairing:
    """Passes boxes on at once, or with their masks while masks arrive; at the latest with the next.

    Args:
        tolerance_ns: Stamps that differ by no more belong together.
    """

    def __init__(self, tolerance_ns: int) -> None:
        self._tolerance_ns = tolerance_ns
        self._masks: list[StampedMasks] = []
        self._waiting: StampedBoxes | None = None
        self._masks_come = False

    def add_boxes(self, boxes: StampedBoxes) -> list[StampedDetections]:
        """Take boxes; return what is complete."""
        complete: list[StampedDetections] = []
        if self._waiting is not None:
            # No masks arrive any more: boxes no longer wait for them.
            self._masks_come = False
            complete.append(_joined(self._waiting, None))
            self._waiting = None
        mine = next((one for one in self._masks if self._belong(boxes, one)), None)
        if mine is None and self._masks_come:
            self._waiting = boxes
        else:
            complete.append(_joined(boxes, mine))
        return complete

    def add_masks(self, masks: StampedMasks) -> list[StampedDetections]:
        """Take masks; return what is complete."""
        self._masks_come = True
        boxes = self._waiting
        if boxes is not None and self._belong(boxes, masks):
            self._waiting = None
            return [_joined(boxes, masks)]
        self._masks = [*self._masks[1 - MAX_MASKS :], masks]
        return []

    def clear(self) -> None:
        """Discard waiting messages, because the robot's clock was set back."""
        self._masks, self._waiting, self._masks_come = [], None, False

    def _belong(self, boxes: StampedBoxes, masks: StampedMasks) -> bool:
        return abs(boxes.stamp_ns - masks.stamp_ns) <= self._tolerance_ns


def _joined(boxes: StampedBoxes, masks: StampedMasks | None) -> StampedDetections:
    return StampedDetections(stamp_ns=boxes.stamp_ns, boxes=boxes, masks=masks)
