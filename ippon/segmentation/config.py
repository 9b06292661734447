"""Configuration of the segmentation."""

from dataclasses import dataclass
from typing import Literal

Backend = Literal[
    "san", "clipseg", "owlv2", "sam3", "sam3-lite", "grounding-dino", "detector", "installed"
]  # fmt: skip
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
    """Network, device, and options of the segmentation."""

    backend: Backend = "san"
    """`san` and `clipseg` score every pixel; `owlv2` and `grounding-dino` find boxes, which SAM or
    SAM 2 turns into masks; `sam3` and `sam3-lite` find instances with masks; `detector` finds the
    classes of its file; `installed` is one that another package adds, named by `model`."""
    model: str = ""
    """Name or path of the checkpoint; empty for the backend's default. For `detector` an .onnx
    file, or an ncnn .param file with its .bin beside it."""
    masks_model: str = ""
    """Name or folder of the network for masks: SAM for `owlv2`, SAM 2 or EdgeTAM for
    `grounding-dino`; empty for the default, `none` for boxes only. For `detector` there is no
    default."""
    device: str = "auto"
    """`auto` uses a GPU if there is one; else `cpu`, `cuda`, `cuda:1` and so on."""
    precision: Precision = "auto"
    """`auto` is half precision on a GPU and float32 elsewhere."""
    compile: bool = False
    """Compile the network for the GPU: a minute more at the start, then faster images."""
    longest_side_px: int = 160
    """Longer side of the heatmap; larger has finer outlines and needs more bandwidth."""
    short_side_px: int = 640
    """Shorter side of SAN's input image; larger detects smaller objects and takes longer."""
    small_objects: bool = False
    """Segment a crop a second time where the object of interest appears small (`san`, `clipseg`);
    without one, as in recordings, images get one pass."""
    labels_file: str = ""
    """Classes of the `detector`, one per line in the order of its outputs; `couch = sofa, settee`
    lists the labels of a class. Empty for the classes in the model's files, else COCO's."""
    family: DetectorFamily = "auto"
    """Family of the `detector`; `auto` recognises it by its outputs."""
    threads: int = 0
    """CPU cores of the `detector`; 0 for all."""
    input_px: int = 0
    """Side of the `detector`'s square input, if its file leaves it open; larger detects smaller
    objects and takes longer. 0 for the default."""

    def __post_init__(self) -> None:
        """Reject sizes out of range."""
        if not 8 <= self.longest_side_px <= 2048:
            raise ValueError(f"longest_side_px must be 8 to 2048; got {self.longest_side_px}")
        if not 64 <= self.short_side_px <= 2048:
            raise ValueError(f"short_side_px must be 64 to 2048; got {self.short_side_px}")
        if not 0 <= self.threads <= 1024:
            raise ValueError(f"threads must be 0 (all) to 1024; got {self.threads}")
        if self.input_px and not 64 <= self.input_px <= 4096:
            raise ValueError(f"input_px must be 0 (the usual) or 64 to 4096; got {self.input_px}")
