"""Errors of recordings."""


class RecordingError(Exception):
    """A recording cannot be written or read; the text says why and what would work."""
