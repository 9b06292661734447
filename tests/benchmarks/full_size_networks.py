"""The networks of `transformers` at their published size with random weights: time and memory.

The configurations are the library's defaults, which are those of the published models but for
OWLv2's patches. Random weights run at the same speed; how many instances they find is by chance,
so masks are timed for a number of boxes that is given.
"""

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import torch
import transformers

from app.doctor.segmentation_speed import measure
from ippon.segmentation.backends.box_masks import BoxMasks
from ippon.segmentation.config import Backend, Precision, SegmentationConfig
from ippon.segmentation.loading import load_segmenter
from ippon.vocabulary import MATTERPORT_40
from tests.benchmarks.rows import Row
from tests.ippon.segmentation.backends.tiny_models import save_bert_tokenizer, save_clip_tokenizer

NETWORKS: dict[Backend, Callable[[], torch.nn.Module]] = {
    "clipseg": lambda: transformers.CLIPSegForImageSegmentation(transformers.CLIPSegConfig()),
    "owlv2": lambda: transformers.Owlv2ForObjectDetection(
        transformers.Owlv2Config(vision_config={"image_size": 960, "patch_size": 16})
    ),
    "grounding-dino": lambda: transformers.MMGroundingDinoForObjectDetection(
        transformers.MMGroundingDinoConfig()
    ),
    "sam3": lambda: transformers.Sam3Model(transformers.Sam3Config()),
    "sam3-lite": lambda: transformers.Sam3LiteTextModel(transformers.Sam3LiteTextConfig()),
}
MASKS: dict[str, Callable[[], torch.nn.Module]] = {
    "SAM 2.1 (tiny)": lambda: transformers.Sam2Model(transformers.Sam2Config()),
    "SAM (base)": lambda: transformers.SamModel(transformers.SamConfig()),
}
PRECISIONS: tuple[Precision, ...] = ("float32", "float16")
BOXES = 10


def full_size_rows() -> Iterator[Row]:
    """Time each network on the GPU; there are no rows without one."""
    if not torch.cuda.is_available():
        return
    where = torch.cuda.get_device_name()
    for backend, build in NETWORKS.items():
        with tempfile.TemporaryDirectory() as folder:
            build().save_pretrained(folder)
            save = save_bert_tokenizer if backend == "grounding-dino" else save_clip_tokenizer
            save(Path(folder))
            for precision in PRECISIONS:
                config = SegmentationConfig(
                    backend=backend, model=folder, masks_model="none", precision=precision
                )
                yield from _network_rows(backend, config, f"{precision}, {where}")
    for name, build in MASKS.items():
        with tempfile.TemporaryDirectory() as folder:
            build().save_pretrained(folder)
            yield _mask_row(name, Path(folder), where)


def _network_rows(name: str, config: SegmentationConfig, data: str) -> Iterator[Row]:
    torch.cuda.reset_peak_memory_stats()
    before = torch.cuda.memory_allocated()
    speed = measure(load_segmenter(config, Path(config.model)), "")
    held = torch.cuda.max_memory_allocated() - before
    data = f"640x640, {len(MATTERPORT_40) + 1} labels, {data}"
    yield Row(name=name, data=data, median_ms=1e3 * speed.image_s)
    yield Row(name=f"{name}, GPU memory", data=data, value=held / 1e9, unit="GB")


def _mask_row(name: str, folder: Path, where: str) -> Row:
    masks = BoxMasks(str(folder), SegmentationConfig(), folder)
    color = np.random.default_rng(0).integers(0, 256, (480, 640, 3), np.uint8)
    corners = np.random.default_rng(1).uniform(0, 300, (BOXES, 2))
    boxes = np.hstack([corners, corners + 120])
    times = [_outline_ms(masks, color, boxes) for _ in range(20)]
    return Row(
        name=f"masks, {name}",
        data=f"640x480, {BOXES} boxes, float16, {where}",
        median_ms=float(np.median(times[3:])),
    )


def _outline_ms(masks: BoxMasks, color: np.ndarray, boxes: np.ndarray) -> float:
    start, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
    with torch.inference_mode():
        start.record()
        masks.outline(color, boxes, (120, 160)).cpu()
        end.record()
    end.synchronize()
    return start.elapsed_time(end)
