"""Errors of detector files."""

from ippon.segmentation.errors import CheckpointError


class OutputError(CheckpointError):
    """The outputs of a network do not match its family or its labels."""
