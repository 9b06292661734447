"""Errors of segmentation networks; each message says what would work."""

from ippon.errors import IpponError


class SegmentationError(IpponError):
    """A segmentation network is not available, or failed."""


class CheckpointError(SegmentationError):
    """A file of a network is missing, damaged, or of another network."""


class MissingPackageError(SegmentationError):
    """A package of an optional extra is not installed."""


class OutOfMemoryError(SegmentationError):
    """The device's memory is too small for this image."""


NOT_NUMBERS = "the network gave {} that are not numbers; try --segmentation.precision float32"
"""After overflow of half precision; takes what it gave."""
INSTALL_HINT = (
    'pip install "ippon[segmentation]" (without a GPU run "pip install torch --index-url '
    'https://download.pytorch.org/whl/cpu" first, or scripts/setup --segmentation, which does '
    "both)"
)
WITHOUT_NETWORK = (
    "Without it `ippon demo`, `ippon sim` and `ippon eval` work, and so does a robot that "
    "publishes its own heatmaps on camera/heatmap."
)
