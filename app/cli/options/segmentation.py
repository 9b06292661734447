"""Options of a segmentation network, shared by several commands."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ippon.segmentation.config import Backend, DetectorFamily, Precision


@dataclass(frozen=True, slots=True, kw_only=True)
class Segmentation:
    """A segmentation network; scripts/setup --segmentation or --detector installs the packages."""

    backend: Backend = "san"
    """san (used in the paper) and clipseg classify every pixel; owlv2 finds boxes that SAM
    segments; sam3 and sam3-lite find instances with masks; grounding-dino finds boxes that SAM 2
    segments; detector finds the classes that its file was trained on (scripts/setup --detector);
    installed is a network that another package adds, named by model."""
    model: str = ""
    """Name or path of the checkpoint: san_vit_b_16, san_vit_large_14, a file or a folder. Empty
    selects the backend's default. For detector, an .onnx file, or an ncnn .param file with its .bin
    beside it."""
    masks_model: str = ""
    """Name or folder of the SAM that segments the boxes of owlv2, or of the SAM 2 or EdgeTAM for
    grounding-dino; none keeps the boxes, empty selects the default. For detector, only if named."""
    models: Path | None = None
    """Folder of the checkpoints; by default in the user's data folder."""
    device: str = "auto"
    """auto (a GPU if there is one), cpu, cuda, cuda:1 and so on."""
    precision: Precision = "auto"
    """auto (half precision on a GPU, else float32), or a type."""
    compile: bool = False
    """Compile the network: takes about a minute at the start, then speeds up each image."""
    longest_side_px: int = 160
    """Longer side of the heatmaps in pixels; larger ones are finer and take more bytes."""
    short_side_px: int = 640
    """Shorter side of SAN's input image in pixels; larger images show smaller objects and take
    longer."""
    small_objects: bool = True
    """In a search with san or clipseg, segment a crop as well where the object of interest is small
    or not found; recordings get one pass over each image."""
    labels_file: str = ""
    """File of the detector's classes, one per line in the order of its outputs; "couch = sofa,
    settee" adds synonyms. Empty uses the classes in the model file, else COCO's 80."""
    family: DetectorFamily = "auto"
    """Family of the detector; auto recognises it by its outputs."""
    threads: int = 0
    """CPU cores that the detector uses; 0 for all."""
    input_px: int = 0
    """Side of the detector's square input image in pixels, if its file does not fix it; larger
    images show smaller objects and take longer. 0 selects the default."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigatorSegmentation(Segmentation):
    """A segmentation network, if the robot does not run one."""

    where: Literal["robot", "here"] = "robot"
    """robot: heatmaps come from the robot or from an `ippon segment` elsewhere; here: a process
    beside the navigator makes them."""
