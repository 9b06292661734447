"""Families of detectors: input conventions, and recognition of their outputs."""

from dataclasses import dataclass
from typing import Any, Final, Literal

from numpy.typing import NDArray

from ippon.segmentation.config import DetectorFamily
from ippon.segmentation.detectors.decoding.candidates import Candidates, grid_cells
from ippon.segmentation.detectors.decoding.detr import decode_labelled, decode_queries
from ippon.segmentation.detectors.decoding.nanodet import STRIDES as NANODET_STRIDES
from ippon.segmentation.detectors.decoding.nanodet import decode_nanodet
from ippon.segmentation.detectors.decoding.yolo import (
    OBJECTNESS,
    STRIDES,
    decode_rows,
    decode_yolov8,
    decode_yolox,
)
from ippon.segmentation.detectors.errors import OutputError
from ippon.segmentation.detectors.image_input import Fit
from ippon.segmentation.detectors.network import Tensors

Family = Literal[
    "nanodet", "yolox", "yolov5", "yolov8", "yolov10", "rt-detr", "rf-detr", "detr", "rt-detr-own"
]
"""`rt-detr` and `rt-detr-own` are RT-DETR and D-FINE as exported by `transformers` and by their
authors' repositories."""

_IMAGENET: Final[dict[str, Any]] = {
    "mean": (123.675, 116.28, 103.53),
    "factor": (1 / 58.395, 1 / 57.12, 1 / 57.375),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class InputConvention:
    """Input of a family's networks."""

    fit: Fit
    channels: Literal["RGB", "BGR"] = "RGB"
    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of values of 0 to 255, in the order of `channels`."""
    factor: tuple[float, float, float] = (1 / 255, 1 / 255, 1 / 255)
    padding: int | None = 114
    overlap: float = 0.6
    """Intersection over union above which two boxes of a class are one object."""


INPUT_CONVENTIONS: Final[dict[Family, InputConvention]] = {
    "nanodet": InputConvention(
        fit="corner",
        channels="BGR",
        mean=(103.53, 116.28, 123.675),
        factor=(0.017429, 0.017507, 0.017125),
        padding=None,
    ),
    "yolox": InputConvention(fit="corner", channels="BGR", factor=(1.0, 1.0, 1.0)),
    "yolov5": InputConvention(fit="centre"),
    "yolov8": InputConvention(fit="centre"),
    "yolov10": InputConvention(fit="centre"),
    "rt-detr": InputConvention(fit="stretch"),
    "rt-detr-own": InputConvention(fit="stretch"),
    "rf-detr": InputConvention(fit="stretch", **_IMAGENET),
    "detr": InputConvention(fit="stretch", **_IMAGENET),
}
_LOGITS: Final = ("logits", "pred_logits")
_MOST_ROWS: Final = 1000
"""Most rows of a network with built-in suppression, which typically returns 100 to 300."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputLayout:
    """Layout of a network's outputs."""

    family: Family
    names: tuple[str, ...]
    """Outputs in the order of the family's decoder; masks last."""
    classes: int | None
    """Number of classes in the outputs; None if it is not determined."""
    spare_column: bool = False
    """Whether the last column may stand for no class."""


def recognise(
    outputs: Tensors, input_size: tuple[int, int], wanted: DetectorFamily, classes: int | None
) -> OutputLayout:
    """Recognise the family of some outputs by names and shapes.

    Args:
        outputs: Outputs for one image, with or without a batch dimension of one.
        input_size: (H, W) of the input.
        wanted: A family, or `auto`.
        classes: Number of labels if a file states it.

    Raises:
        OutputError: The outputs are not of a known family, or not of the wanted one.
    """
    shaped = {name: without_batch(values) for name, values in outputs.items()}
    layout = _labelled(shaped) or _queries(shaped) or _grids(shaped, input_size, classes)
    if layout is None:
        said = ", ".join(f"{name} {values.shape}" for name, values in shaped.items())
        raise OutputError(
            f"these outputs are not of a known detector: {said} for an input of "
            f"{input_size[1]}x{input_size[0]}; known are "
            f"{', '.join(INPUT_CONVENTIONS)}{_guess(shaped)}"
        )
    return _as_wanted(layout, wanted)


def _as_wanted(layout: OutputLayout, wanted: DetectorFamily) -> OutputLayout:
    """Apply the family that the user configured, if the outputs allow it."""
    if wanted in {"auto", layout.family}:
        return layout
    alike: tuple[tuple[Family, ...], ...] = (
        ("rt-detr", "rf-detr", "detr"),
        ("yolox", "yolov5"),
    )
    for group in alike:
        if layout.family in group and wanted in group:
            columns = (layout.classes or 0) + (layout.family == "detr")
            return OutputLayout(
                family=wanted,  # pyright: ignore[reportArgumentType], it is in the group
                names=layout.names,
                classes=columns - (wanted == "detr"),
                spare_column=wanted in {"rt-detr", "rf-detr"},
            )
    raise OutputError(
        f"these outputs are those of {layout.family}, not of {wanted}: take "
        "--segmentation.family auto"
    )


def without_batch(values: NDArray[Any]) -> NDArray[Any]:
    """Return an output without a batch dimension of one."""
    return values[0] if values.ndim > 1 and values.shape[0] == 1 else values


def _labelled(shaped: Tensors) -> OutputLayout | None:
    names = {"labels", "boxes", "scores"}
    if names != set(shaped):
        return None
    counts = {len(values) for values in shaped.values()}
    if len(counts) != 1 or shaped["boxes"].shape[1:] != (4,):
        return None
    return OutputLayout(family="rt-detr-own", names=("labels", "boxes", "scores"), classes=None)


def _queries(shaped: Tensors) -> OutputLayout | None:
    """Recognise logits and boxes; RF-DETR's own export names them labels and dets."""
    own = {"dets", "labels"} <= set(shaped)
    logits = "labels" if own else next((name for name in _LOGITS if name in shaped), None)
    boxes = "dets" if own else "pred_boxes"
    if logits is None or boxes not in shaped:
        return None
    scored, placed = shaped[logits], shaped[boxes]
    if scored.ndim != 2 or placed.shape != (len(scored), 4):
        return None
    masks = [
        name
        for name in ("masks", "pred_masks")
        if name in shaped and shaped[name].ndim == 3 and len(shaped[name]) == len(scored)
    ]
    # One column more than COCO's numbers: the 'no object' class of the first DETR.
    first = not own and scored.shape[1] == 92
    # RT-DETR and D-FINE number COCO's classes from 0 to 79, RF-DETR like the data set.
    likely = own or bool(masks) or scored.shape[1] == 91
    family: Family = "detr" if first else "rf-detr" if likely else "rt-detr"
    return OutputLayout(
        family=family,
        names=(logits, boxes, *masks),
        classes=scored.shape[1] - first,
        spare_column=not first,
    )


def _grids(
    shaped: Tensors, input_size: tuple[int, int], classes: int | None
) -> OutputLayout | None:
    """Recognise an output with a row or column per grid cell."""
    cells = len(grid_cells(input_size, STRIDES))
    nanodet = len(grid_cells(input_size, NANODET_STRIDES))
    tables = [name for name, values in shaped.items() if values.ndim == 2]
    pictures = [name for name, values in shaped.items() if values.ndim == 3]
    if len(tables) != 1 or len(shaped) > 2 or len(tables) + len(pictures) != len(shaped):
        return None
    name = tables[0]
    rows, columns = shaped[name].shape
    if columns == cells and rows > 4:
        depth = len(shaped[pictures[0]]) if pictures else 0
        return OutputLayout(family="yolov8", names=(name, *pictures), classes=rows - 4 - depth)
    if pictures:
        return None
    if rows == nanodet and columns > 8:
        return OutputLayout(family="nanodet", names=(name,), classes=classes or 80)
    if rows in {cells, 3 * cells} and columns > 5:
        # YOLOv6 has YOLOX's rows and YOLOv5's input; its objectness is the constant 1.
        constant = bool((shaped[name][:, OBJECTNESS] == 1.0).all())
        family: Family = "yolox" if rows == cells and not constant else "yolov5"
        return OutputLayout(family=family, names=(name,), classes=columns - 5)
    if columns == 6 and rows <= _MOST_ROWS:
        return OutputLayout(family="yolov10", names=(name,), classes=None)
    return None


def _guess(shaped: Tensors) -> str:
    first = next(iter(shaped.values()), None)
    if len(shaped) == 1 and first is not None and first.ndim == 1:
        return f". It looks like a classifier of {len(first)} classes"
    if len(shaped) == 1 and first is not None and first.ndim == 3:
        return ". It looks like a network that judges every pixel"
    return ""


def decode(
    outputs: Tensors, layout: OutputLayout, classes: int, input_size: tuple[int, int]
) -> Candidates:
    """Decode the outputs for an image.

    Args:
        outputs: Outputs of the network.
        layout: From `recognise`.
        classes: Number of classes.
        input_size: (H, W) of the input.

    Raises:
        OutputError: The shapes differ from those of the first image.
    """
    values = [without_batch(outputs[name]) for name in layout.names]
    match layout.family:
        case "nanodet":
            return decode_nanodet(values[0], classes, input_size)
        case "yolox" | "yolov5":
            return decode_yolox(values[0], input_size)
        case "yolov8":
            return decode_yolov8(values, classes)
        case "yolov10":
            return decode_rows(values[0], classes)
        case "rt-detr-own":
            return decode_labelled(values[0], values[1], values[2], classes)
        case "rt-detr" | "rf-detr" | "detr":
            masks = values[2] if len(values) > 2 else None
            softmax = layout.family == "detr"
            return decode_queries(values[0], values[1], masks, input_size, softmax=softmax)
