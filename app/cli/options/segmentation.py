"""Options of a segmentation network, as several commands take them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ippon.segmentation.config import Backend, DetectorFamily, Precision


@dataclass(frozen=True, slots=True, kw_only=True)
class Segmentation:
    """A network; needs an extra: scripts/setup --segmentation, or --detector for detectors."""

    backend: Backend = "san"
    """san, the paper's, and clipseg judge every pixel; owlv2 finds boxes that SAM outlines; sam3
    and sam3-lite find instances with masks; grounding-dino finds boxes that SAM 2 outlines;
    detector finds the kinds of thing that its file was trained on (scripts/setup --detector)."""
    model: str = ""
    """Name or path of the checkpoint: san_vit_b_16, san_vit_large_14, a file or a folder. Empty
    takes the backend's usual one. For detector an .onnx file, or an ncnn .param file with its .bin
    beside it."""
    masks_model: str = ""
    """Name or folder of the SAM that outlines what owlv2 finds, or of the SAM 2 or EdgeTAM for
    grounding-dino, where none leaves boxes alone; empty takes the usual one. Behind detector only
    where one is named."""
    models: Path | None = None
    """Folder of the checkpoints that are given by name; without one, the user's data folder."""
    device: str = "auto"
    """auto takes a GPU where there is one; else cpu, cuda, cuda:1 and so on."""
    precision: Precision = "auto"
    """auto is half precision on a GPU and float32 elsewhere."""
    compile: bool = False
    """Compile the network: about a minute at the start, faster images after it."""
    longest_side_px: int = 160
    """Longer side of the heatmaps; larger outlines finer and sends more bytes."""
    short_side_px: int = 640
    """Shorter side of the image that SAN sees; larger sees smaller things and takes longer."""
    small_objects: bool = True
    """Look a second time at a crop where the object of interest is small or not to be seen."""
    labels_file: str = ""
    """Classes of the detector, one a line in the order of its outputs; "couch = sofa, settee" says
    what a class answers to. Empty takes what the model says of itself, else COCO's 80."""
    family: DetectorFamily = "auto"
    """Make of the detector; auto tells it by its outputs."""
    threads: int = 0
    """Cores that the detector uses on the processor; 0 for all."""
    input_px: int = 0
    """Side of the square image that the detector sees, where its file leaves that open; larger sees
    smaller things and takes longer. 0 takes the usual one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigatorSegmentation(Segmentation):
    """A segmentation network, where the robot does not run one."""

    where: Literal["robot", "here"] = "robot"
    """robot: heatmaps come from the robot, or from `ippon segment` anywhere; here: a process beside
    the navigator makes them."""
