"""Which segmentation runs, and how."""

from dataclasses import dataclass
from typing import Literal

Backend = Literal["san", "clipseg", "owlv2", "sam3", "sam3-lite", "grounding-dino", "detector"]
DetectorFamily = Literal[
    "auto",
    "nanodet",
    "yolox",
    "yolov5",
    "yolov8",
    "yolov10",
    "rt-detr",
    "rt-detr-own",
    "rf-detr",
    "detr",
]
Precision = Literal["auto", "float32", "float16", "bfloat16"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentationConfig:
    """A network, where it runs, and what is done about small and unknown things."""

    backend: Backend = "san"
    """`san` and `clipseg` judge every pixel; `owlv2` finds boxes that SAM outlines; `sam3` and
    `sam3-lite` find instances with masks; `grounding-dino` finds boxes that SAM 2 outlines;
    `detector` finds the kinds of thing that its file was trained on."""
    model: str = ""
    """Name or path of the checkpoint; empty takes the backend's usual one. For `detector` an .onnx
    file, or an ncnn .param file with its .bin beside it."""
    masks_model: str = ""
    """Name or folder of the SAM that outlines what `owlv2` finds, or of the SAM 2 or EdgeTAM for
    `grounding-dino`, where `none` leaves boxes alone; empty takes the usual one. Behind
    `detector` only where one is named."""
    device: str = "auto"
    """`auto` takes a GPU where there is one; else `cpu`, `cuda`, `cuda:1` and so on."""
    precision: Precision = "auto"
    """`auto` is half precision on a GPU and float32 elsewhere."""
    compile: bool = False
    """Compile the network for the GPU: about a minute at the start, faster images after it."""
    longest_side_px: int = 160
    """Longer side of the heatmap; larger outlines finer and sends more bytes."""
    short_side_px: int = 640
    """Shorter side of the image that SAN sees; larger sees smaller things and takes longer."""
    small_objects: bool = False
    """Look a second time at a crop where the object of interest seems small."""
    distractors: bool = False
    """Offer the network labels of common small things, so that what is no object of interest has
    something better to be taken for."""
    labels_file: str = ""
    """Classes of the `detector`, one a line in the order of its outputs; `couch = sofa, settee`
    says what a class answers to. Empty takes what the model says of itself, else COCO's."""
    family: DetectorFamily = "auto"
    """Make of the `detector`; `auto` tells it by its outputs."""
    threads: int = 0
    """Cores that the `detector` uses on the processor; 0 for all."""
    input_px: int = 0
    """Side of the square image that the `detector` sees, where its file leaves that open; larger
    sees smaller things and takes longer. 0 takes the usual one."""

    def __post_init__(self) -> None:
        """Refuse sizes that no network takes."""
        if not 8 <= self.longest_side_px <= 2048:
            raise ValueError(f"longest_side_px must be 8 to 2048; got {self.longest_side_px}")
        if not 64 <= self.short_side_px <= 2048:
            raise ValueError(f"short_side_px must be 64 to 2048; got {self.short_side_px}")
        if not 0 <= self.threads <= 1024:
            raise ValueError(f"threads must be 0 (all) to 1024; got {self.threads}")
        if self.input_px and not 64 <= self.input_px <= 4096:
            raise ValueError(f"input_px must be 0 (the usual) or 64 to 4096; got {self.input_px}")
