"""A closed-vocabulary detector as a segmenter."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ippon.observation import Detections
from ippon.segmentation.config import DetectorFamily, SegmentationConfig
from ippon.segmentation.detectors.decoding.candidates import Candidates
from ippon.segmentation.detectors.errors import OutputError
from ippon.segmentation.detectors.families import INPUT_CONVENTIONS, OutputLayout, decode, recognise
from ippon.segmentation.detectors.image_input import ImageInput, Placement
from ippon.segmentation.detectors.labels import (
    labels_beside,
    matched_vocabulary,
    read_description,
    read_labels_file,
)
from ippon.segmentation.detectors.model_file import HUB_FOLDER, find_model, open_network
from ippon.segmentation.detectors.network import LARGEST_SIDE_PX, Network, Tensors
from ippon.segmentation.detectors.suppression import non_maximum_suppression
from ippon.segmentation.detectors.vocabulary import Assignment
from ippon.segmentation.errors import CheckpointError, SegmentationError
from ippon.segmentation.instances import MAX_INSTANCES, make_detections
from ippon.segmentation.segmenter import checked_channels

LEAST_SCORE: Final = 0.05
"""Least score of a box; low, because the observation model weighs scores, and not lower, because
hundreds of boxes per image follow."""
NOT_NUMBERS: Final = (
    "the network gave scores that are not numbers, for example after overflow of half precision: "
    "export it in float32"
)
_SIDE_PX: Final = 640
"""Side of the input if the file leaves it open, as in most detectors."""
_SIZES: Final = ("orig_target_sizes", "images_sizes", "orig_size")
"""Names of the input of RT-DETR's and D-FINE's own exports for the size that boxes refer to."""
_MASK: Final = "pixel_mask"
"""Name of the input of DETR's exports that marks image pixels."""


_KINDS: Final[Mapping[object, DetectorFamily]] = {
    "detr": "detr",
    "yolos": "detr",
    "rf_detr": "rf-detr",
    "rt_detr": "rt-detr",
    "rt_detr_v2": "rt-detr",
    "d_fine": "rt-detr",
}
"""Families of types of `transformers`, whose outputs alone tell no family by 91 or 92 classes."""


class Detector:
    """Detects the classes that a network was trained on; implements `Segmenter`."""

    def __init__(self, config: SegmentationConfig, folder: Path) -> None:
        """Load a network and recognise its family.

        Args:
            config: `model`, `device`, `labels_file`, `family`, `threads` and `input_px` are used.
            folder: Folder of models that are given by name.

        Raises:
            CheckpointError: A file is missing, damaged, or not of a known detector.
            MissingPackageError: onnxruntime or ncnn is not installed.
            SegmentationError: The device does not exist.
        """
        path = find_model(config.model, folder)
        self._network: Network = open_network(
            path, device=config.device, threads=config.threads, input_px=config.input_px
        )
        self.source = source_name(path)
        self._image, size = image_name_and_size(self._network, config.input_px)
        if self._network.notes.get("head") == "RTDETRDecoder":
            raise CheckpointError(
                f"{path.name} is RT-DETR as Ultralytics exports it, which is not known here: export"
                " it with its authors' repository or with optimum (transformers)"
            )
        said = (
            read_labels_file(Path(config.labels_file))
            if config.labels_file
            else labels_beside(path, self._network.notes)
        )
        # Run on zeros to get the shapes of the outputs, which the file may leave open.
        outputs = self._network.run(self._feeds(np.zeros((3, *size), np.float32)))
        self.layout: OutputLayout = recognise(
            outputs, size, _family(config.family, path), None if said is None else len(said.classes)
        )
        self.vocabulary = matched_vocabulary(said, self.layout)
        """Its classes."""
        self.image_input = image_input(self.layout, size, path)
        self._read(outputs)

    def segment(
        self, color: NDArray[np.uint8], labels: Sequence[str], ooi: str | None
    ) -> Detections:
        """Return the instances of the labels that the network knows; see `Segmenter.segment`."""
        return self.segment_tour(color, labels, () if ooi is None else (ooi,))

    def segment_tour(
        self, color: NDArray[np.uint8], labels: Sequence[str], goals: Sequence[str]
    ) -> Detections:
        """Return the instances of the labels that the network knows; see `segment_tour`."""
        ooi = goals[0] if goals else None
        checked_channels(color, labels, ooi)
        values, place = self.image_input.prepare(color)
        found = self._read(self._network.run(self._feeds(values)))
        return self._detections(found, place, self.vocabulary.assign(labels, ooi, goals[1:]))

    def _feeds(self, values: NDArray[np.float32]) -> Tensors:
        """Return the network's inputs for one prepared image."""
        feeds: dict[str, NDArray[Any]] = {}
        for name, said in self._network.inputs.items():
            if name == self._image:
                feeds[name] = values[None]
            elif name in _SIZES:
                # Width before height, so that boxes are in pixels of the input.
                feeds[name] = np.array([values.shape[:0:-1]], np.int64)
            elif name == _MASK:
                # Some exports fix its size, others take that of the image.
                sides = zip(said[1:], values.shape[1:], strict=True)
                feeds[name] = np.ones((1, *(fixed or side for fixed, side in sides)), np.int64)
        return feeds

    def _read(self, outputs: Tensors) -> Candidates:
        found = decode(outputs, self.layout, len(self.vocabulary.classes), self.image_input.size)
        if found.scores.shape[1] != len(self.vocabulary.classes):
            raise OutputError(
                f"the network gives {found.scores.shape[1]} scores a box and has "
                f"{len(self.vocabulary.classes)} classes"
            )
        return found

    def _detections(self, found: Candidates, place: Placement, assigned: Assignment) -> Detections:
        """Return the detections of the requested labels, one box per object."""
        columns = [k for k, one in enumerate(assigned.label_of_class) if one is not None]
        asked = found.scores[:, columns]
        if np.isnan(asked).any():
            raise SegmentationError(NOT_NUMBERS)
        rows, picked = np.nonzero(asked >= LEAST_SCORE)
        classes = np.array(columns, np.int64)[picked]
        # Classes of one label are suppressed together.
        kinds = np.array(
            [assigned.labels.index(str(assigned.label_of_class[k])) for k in classes], np.int64
        )
        scores = found.scores[rows, classes]
        boxes = found.boxes[rows]
        keep = np.argsort(-scores, kind="stable")
        if not found.distinct:
            finite = np.flatnonzero(np.isfinite(boxes).all(axis=1))
            overlap = INPUT_CONVENTIONS[self.layout.family].overlap
            keep = finite[
                non_maximum_suppression(
                    boxes[finite], scores[finite], kinds[finite], overlap, MAX_INSTANCES
                )
            ]
        keep = keep[:MAX_INSTANCES]
        masks = None
        if found.masks is not None:
            outlines = found.masks([int(rows[k]) for k in keep], place)
            # Of an object smaller than a pixel of its mask only the box is known.
            masks = [mask if mask.any() else None for mask in outlines]
        return make_detections(
            place.boxes_in_image(boxes[keep]),
            scores[keep],
            [assigned.labels[kinds[k]] for k in keep],
            source=self.source,
            labels=assigned.labels,
            ooi=assigned.ooi,
            image_size=place.image_size,
            masks=masks,
        )


def source_name(path: Path) -> str:
    """Return the name of a network: that of its file, or of its folder for generic file names.

    Exports of `transformers` are called model.onnx, those of the hub onnx/model.onnx, those of
    Ultralytics model.ncnn.param.
    """
    stem = path.stem.removesuffix(".ncnn")
    if stem.split("_", maxsplit=1)[0] != "model":
        return stem
    folder = path.absolute().parent
    return folder.parent.name if folder.name == HUB_FOLDER else folder.name


def image_name_and_size(network: Network, input_px: int) -> tuple[str, tuple[int, int]]:
    """Return the name of the image input and its (H, W).

    Args:
        network: Loaded.
        input_px: Side if the file leaves it open; 0 for the default.

    Raises:
        CheckpointError: The network does not take one image, or takes another size.
    """
    images = {name: shape for name, shape in network.inputs.items() if len(shape) == 4}
    others = set(network.inputs) - set(images) - {*_SIZES, _MASK}
    name, shape = next(iter(images.items()), ("", None))
    fits = shape is not None and shape[0] in {None, 1} and shape[1] in {None, 3} and shape[3] != 3
    if shape is None or not fits or len(images) != 1 or others:
        said = ", ".join(f"{one} {size}" for one, size in network.inputs.items())
        raise CheckpointError(
            f"this network takes {said}; a detector takes one image, (1, 3, height, width)"
        )
    side = input_px or _SIDE_PX
    height, width = shape[2] or side, shape[3] or side
    if input_px and {height, width} != {input_px}:
        raise CheckpointError(
            f"this network takes images of {width}x{height} alone; leave out "
            "--segmentation.input-px"
        )
    if max(height, width) > LARGEST_SIDE_PX:
        raise CheckpointError(
            f"this network takes images of {width}x{height}; a detector takes at most "
            f"{LARGEST_SIDE_PX} pixels a side"
        )
    return name, (height, width)


def _family(wanted: DetectorFamily, model: Path) -> DetectorFamily:
    """Return the configured family, or that in `config.json` beside the model."""
    if wanted != "auto":
        return wanted
    return _KINDS.get(read_description(model).get("model_type"), "auto")


def image_input(layout: OutputLayout, size: tuple[int, int], model: Path) -> ImageInput:
    """Return the preprocessing that the network expects.

    The family's convention applies, unless `preprocessor_config.json` beside the model has other
    means and deviations.
    """
    habits = INPUT_CONVENTIONS[layout.family]
    mean, factor = habits.mean, habits.factor
    said = read_description(model, "preprocessor_config.json")
    if said.get("do_normalize") is True:
        mean = _triple([255.0 * x for x in said.get("image_mean", [])], mean)
        factor = _triple([1.0 / (255.0 * x) for x in said.get("image_std", [])], factor)
    elif said.get("do_normalize") is False:
        mean, factor = (0.0, 0.0, 0.0), (1 / 255, 1 / 255, 1 / 255)
    return ImageInput(
        size=size,
        fit=habits.fit,
        channels=habits.channels,
        mean=mean,
        factor=factor,
        padding=habits.padding,
    )


def _triple(said: list[float], usual: tuple[float, float, float]) -> tuple[float, float, float]:
    return (said[0], said[1], said[2]) if len(said) == 3 else usual
