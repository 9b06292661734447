"""A detector: bright blobs are lamps.

`ippon segment --segmentation.backend installed --segmentation.model blobs` runs it.
"""

from pathlib import Path

from scipy import ndimage

from ippon.observation import Detections, Instance
from ippon.segmentation.config import SegmentationConfig

KNOWN = "lamp"
BRIGHT, LEAST_PX = 230, 50


class Blobs:
    """Finds instances with boxes and masks."""

    def segment(self, color, labels, ooi):
        """Return a lamp for each bright blob; the other labels are not known."""
        wanted = (*labels, *(() if ooi is None or ooi in labels else (ooi,)))
        known = (KNOWN,) if KNOWN in wanted else ()
        blobs, _ = ndimage.label(color.min(axis=2) > BRIGHT) if known else (None, 0)
        found = []
        for k, at in enumerate([] if blobs is None else ndimage.find_objects(blobs), 1):
            mask = blobs == k
            if mask.sum() >= LEAST_PX:
                box = (at[1].start, at[0].start, at[1].stop, at[0].stop)
                found.append(Instance(label=KNOWN, score=0.6, box_px=box, mask=mask))
        return Detections(
            source="blobs",
            labels=known,
            ooi=ooi if ooi in known else None,
            image_size=color.shape[:2],
            instances=tuple(found),
        )


def load(config: SegmentationConfig, folder: Path) -> Blobs:
    """Return the detector; `config` has its options."""
    return Blobs()
