"""Errors of the viewers of other programs."""


class ViewerError(Exception):
    """A viewer cannot be started; the text says what would work."""
