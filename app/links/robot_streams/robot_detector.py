"""Converts the output of a detector on the robot to the labels of the map."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.messages.cdr import MessageError
from app.messages.perception.detection_masks import StampedMasks, masks_of
from app.messages.perception.detections import StampedBoxes
from app.messages.perception.detector_info import LabelNames
from app.robot_file import DetectorTable
from ippon.observation import Detections, Heatmap
from ippon.segmentation.detectors.coco import synonyms_of_class
from ippon.segmentation.detectors.vocabulary import ClosedVocabulary
from ippon.segmentation.instance_heatmap import heatmap_of_instances
from ippon.segmentation.instances import make_detections
from ippon.vocabulary import canonical_label

UNNAMED = "detector"
"""Name of a detector without a name in profile and messages."""


class RobotDetector:
    """Converts boxes with a detector's class names to observations of the map's labels.

    A class name maps to its label in the robot's table, else to itself and its synonyms. If the
    class names are known, from label info or the table, their labels without a box count as not
    recognised; other labels without a box are not observed.

    Args:
        table: Detector table of the robot's profile.
    """

    def __init__(self, table: DetectorTable | None = None) -> None:
        self._table = table or DetectorTable()
        self._own = {canonical_label(k): canonical_label(v) for k, v in self._table.labels.items()}
        self._source = self._table.source or UNNAMED
        self._numbers: dict[int, str] = {}
        self._vocabulary = self._vocabulary_of(tuple(self._own))
        self._labels: tuple[str, ...] = ()
        self._ooi: str | None = None
        self._also: tuple[str, ...] = ()
        self._carries: dict[str, str | None] = {}
        self.misfits = 0
        """Number of images in a row of which most boxes are invalid; those without are left out."""
        self.problem = ""
        """Why the last masks were refused; empty if they were used."""

    def ask(self, labels: Sequence[str], ooi: str | None, also: Sequence[str] = ()) -> None:
        """Set the labels of the map, the object of interest and further objects of interest."""
        asked = (*labels, *also), ooi
        if asked != (self._labels, self._ooi):
            self._labels, self._ooi = asked
            self._also = tuple(also)
            self._carries.clear()

    def name_network(self, name: str) -> None:
        """Set the name of the network; a name in the profile overrides it."""
        self._source = self._table.source or name

    def name_labels(self, info: LabelNames) -> None:
        """Set the class names of the detector."""
        if info.names != self._numbers:
            self._numbers = info.names
            self._vocabulary = self._vocabulary_of(tuple(info.names.values()))
            self._carries.clear()

    def refusal(self) -> str:
        """Return why the detector cannot recognise an object of interest; empty if it can."""
        if self._ooi is None or self._vocabulary is None:
            return ""
        unknown = (x for x in (self._ooi, *self._also) if not self._vocabulary.knows(x))
        label = next(unknown, None)
        return "" if label is None else self._vocabulary.unsupported_reason(label)

    def heatmap(
        self, boxes: StampedBoxes, masks: StampedMasks | None, depth: NDArray[np.float32]
    ) -> Heatmap:
        """Return the score of each label at each pixel.

        Args:
            boxes: Boxes of an image.
            masks: Masks of the same image; if they do not fit the boxes, `problem` says why, and
                boxes become pixels by depth.
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
        return heatmap_of_instances(self.detections(boxes, pixels, (h, w)), depth)

    def detections(
        self,
        boxes: StampedBoxes,
        masks: Sequence[NDArray[np.bool_] | None] | None,
        image_size: tuple[int, int],
    ) -> Detections:
        """Return the instances among a detector's boxes.

        Args:
            boxes: Boxes of an image.
            masks: (N) mask of each row of `boxes`; None without masks.
            image_size: (H, W) pixels.
        """
        names = [self._label_of(name) or "" for name in boxes.names]
        asked = self._asked()
        if self._vocabulary is None:
            looked_for = tuple(label for label in asked if label in set(names))
        else:
            # Of two labels of one class, that without boxes is not looked for.
            told = {*names, *map(self._label_of, self._vocabulary.classes)}
            looked_for = tuple(label for label in asked if label in told)
        seen = make_detections(
            boxes.boxes_px,
            boxes.scores,
            names,
            source=self._source,
            labels=looked_for,
            ooi=self._ooi if self._ooi in looked_for else None,
            image_size=image_size,
            masks=masks,
        )
        if seen.dropped > len(seen.instances):
            self.misfits += 1
        elif seen.instances:
            self.misfits = 0
        return seen

    def _asked(self) -> tuple[str, ...]:
        ooi = self._ooi
        return self._labels if ooi is None or ooi in self._labels else (*self._labels, ooi)

    def _label_of(self, name: str) -> str | None:
        """Return the label of a class name; None if the map does not have it."""
        if name not in self._carries:
            text = self._numbers.get(int(name), name) if name.isdecimal() else name
            answers = self._answers_of(canonical_label(text))
            asked = self._asked()
            wanted = (one for one in (self._ooi, *self._also) if one in answers)
            self._carries[name] = next(wanted, next((a for a in answers if a in asked), None))
        return self._carries[name]

    def _answers_of(self, name: str) -> tuple[str, ...]:
        own = self._own.get(name)
        return synonyms_of_class(name, self._labelled) if own is None else (own,)

    def _vocabulary_of(self, names: Sequence[str]) -> ClosedVocabulary | None:
        classes = tuple(dict.fromkeys(canonical_label(name) for name in names))
        kinds = (kind for name in classes for kind in name.split("/"))
        self._labelled = {*classes, *kinds, *self._own.values()}
        return ClosedVocabulary(classes, tuple(map(self._answers_of, classes))) if names else None
