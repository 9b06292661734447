import numpy as np

from ippon.observation import Detections, Instance
from ippon.segmentation.instance_heatmap import _paint_kernel, heatmap_of_instances
from ippon.segmentation.warm_up import warm_up_instances


def test_no_box_or_mask_compiles_anything_later():
    warm_up_instances()
    compiled = set(_paint_kernel.signatures)
    assert len(compiled) == 2
    mask = np.zeros((60, 80), bool)
    mask[10:30, 20:60] = True
    boxes = ((0, 0, 160, 120), (0, 30, 160, 60), (10, 30, 90, 110), (159, 0, 160, 120))
    instances = [Instance(label="cup", score=0.7, box_px=box) for box in boxes]
    instances.append(Instance(label="cup", score=0.7, box_px=(40, 20, 120, 60), mask=mask))
    seen = Detections(
        source="x",
        labels=("table", "cup"),
        ooi="cup",
        image_size=(120, 160),
        instances=tuple(instances),
    )
    for scale in (1, 4):
        heatmap_of_instances(seen, np.full((120 * scale, 160 * scale), 1.5, np.float32))
    assert set(_paint_kernel.signatures) == compiled
