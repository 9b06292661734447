"""What can go wrong with a detector's file beyond what any network's may."""

from ippon.segmentation.errors import CheckpointError


class OutputError(CheckpointError):
    """The outputs of a network are not those of its family, or do not match its labels."""
