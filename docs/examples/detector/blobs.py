"""A detector: bright blobs are lamps.

`ippon segment --segmentation.backend installed --segmentation.model blobs` runs it.
"""

from pathlib import Path

from scipy import ndimage

from ippon.observation import Detections, Instance
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.detectors.vocabulary import ClosedVocabulary

BRIGHT, LEAST_PX = 230, 50


class Blobs:
    """Finds instances with boxes and masks."""

    vocabulary = ClosedVocabulary.of(["lamp"])
    """Its classes: a search for anything else is answered with them."""

    def segment(self, color, labels, ooi):
        """Return a lamp for each bright blob, if lamps were asked for."""
        asked = self.vocabulary.assign(labels, ooi)
        (lamp,) = asked.label_of_class
        blobs, _ = ndimage.label(color.min(axis=2) > BRIGHT) if lamp else (None, 0)
        found = []
        for k, at in enumerate([] if blobs is None else ndimage.find_objects(blobs), 1):
            mask = blobs == k
            if mask.sum() >= LEAST_PX:
                box = (at[1].start, at[0].start, at[1].stop, at[0].stop)
                found.append(Instance(label=lamp, score=0.6, box_px=box, mask=mask))
        return Detections(
            source="blobs",
            labels=asked.labels,
            ooi=asked.ooi,
            image_size=color.shape[:2],
            instances=tuple(found),
        )


def load(config: SegmentationConfig, folder: Path) -> Blobs:
    """Return the detector; `config` has its options."""
    return Blobs()
