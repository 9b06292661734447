"""Reads what a detector on the robot says of an image, in the words of the map."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.messages.cdr import MessageError
from app.messages.detection_masks import StampedMasks, masks_of
from app.messages.detections import StampedBoxes
from app.messages.detector_info import LabelNames
from app.robot_file import DetectorTable
from ippon.observation import Detections, Heatmap
from ippon.segmentation.detectors.coco import synonyms_of_class
from ippon.segmentation.detectors.vocabulary import ClosedVocabulary
from ippon.segmentation.instances import make_detections
from ippon.segmentation.painting import paint
from ippon.vocabulary import canonical_label

UNNAMED = "detector"
"""Source of a detector that neither the profile nor a message names."""


class RobotDetector:
    """Turns boxes with a detector's own words into observations of the map's labels.

    A name stands for the label that the robot's table says, else for itself and its synonyms.
    Where the names of a detector are known, by its label info or by the table, a label that is one
    of them and has no box was not recognised; else nothing is said of labels without a box.

    Args:
        table: Of the robot's profile.
    """

    def __init__(self, table: DetectorTable | None = None) -> None:
        self._table = table or DetectorTable()
        self._own = {canonical_label(k): canonical_label(v) for k, v in self._table.labels.items()}
        self._source = self._table.source or UNNAMED
        self._numbers: dict[int, str] = {}
        self._vocabulary = self._vocabulary_of(tuple(self._own))
        self._labels: tuple[str, ...] = ()
        self._ooi: str | None = None
        self._carries: dict[str, str | None] = {}
        self.problem = ""
        """Why the last masks could not be used; empty where they could."""

    def ask(self, labels: Sequence[str], ooi: str | None) -> None:
        """Say which labels the map tells apart, and what it searches for."""
        asked = tuple(labels), ooi
        if asked != (self._labels, self._ooi):
            self._labels, self._ooi = asked
            self._carries.clear()

    def name_network(self, name: str) -> None:
        """Take the name of the network; that of the profile comes first."""
        self._source = self._table.source or name

    def name_labels(self, info: LabelNames) -> None:
        """Take everything that the detector can tell."""
        if info.names != self._numbers:
            self._numbers = info.names
            self._vocabulary = self._vocabulary_of(tuple(info.names.values()))
            self._carries.clear()

    def refusal(self) -> str:
        """Return why the detector cannot tell the object of interest; empty where it can."""
        if self._ooi is None or self._vocabulary is None or self._vocabulary.knows(self._ooi):
            return ""
        return self._vocabulary.unsupported_reason(self._ooi)

    def heatmap(
        self, boxes: StampedBoxes, masks: StampedMasks | None, depth: NDArray[np.float32]
    ) -> Heatmap:
        """Return the score of each label at each pixel.

        Args:
            boxes: Of an image.
            masks: Of the same image; where they do not fit the boxes, `problem` says why and boxes
                become pixels by depth.
            depth: (H, W) metres, of the same image and registered to it.
        """
        h, w = depth.shape
        pixels = None
        if masks is not None:
            self.problem = ""
            try:
                pixels = masks_of(masks, boxes, (h, w))
            except MessageError as error:
                self.problem = str(error)
        return paint(self.detections(boxes, pixels, (h, w)), depth)

    def detections(
        self,
        boxes: StampedBoxes,
        masks: Sequence[NDArray[np.bool_] | None] | None,
        image_size: tuple[int, int],
    ) -> Detections:
        """Return the instances among a detector's boxes.

        Args:
            boxes: Of an image.
            masks: (N) of each row of `boxes`; None for all without.
            image_size: (H, W) pixels.
        """
        names = [self._label_of(name) or "" for name in boxes.names]
        asked = self._asked()
        if self._vocabulary is None:
            looked_for = tuple(label for label in asked if label in set(names))
        else:
            knows = self._vocabulary.knows
            looked_for = tuple(one for one in asked if one in names or knows(one))
        return make_detections(
            boxes.boxes_px,
            boxes.scores,
            names,
            source=self._source,
            labels=looked_for,
            ooi=self._ooi if self._ooi in looked_for else None,
            image_size=image_size,
            masks=masks,
        )

    def _asked(self) -> tuple[str, ...]:
        ooi = self._ooi
        return self._labels if ooi is None or ooi in self._labels else (*self._labels, ooi)

    def _label_of(self, name: str) -> str | None:
        """Return the label that a box with this name carries; None where nobody asked for it."""
        if name not in self._carries:
            text = self._numbers.get(int(name), name) if name.isdecimal() else name
            answers = self._answers_of(canonical_label(text))
            asked = self._asked()
            self._carries[name] = (
                self._ooi
                if self._ooi in answers
                else next((a for a in answers if a in asked), None)
            )
        return self._carries[name]

    def _answers_of(self, name: str) -> tuple[str, ...]:
        own = self._own.get(name)
        return synonyms_of_class(name) if own is None else (own,)

    def _vocabulary_of(self, names: Sequence[str]) -> ClosedVocabulary | None:
        if not names:
            return None
        classes = tuple(dict.fromkeys(canonical_label(name) for name in names))
        return ClosedVocabulary(classes, tuple(map(self._answers_of, classes)))
