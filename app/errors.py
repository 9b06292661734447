"""Errors of commands."""


class UsageError(Exception):
    """A command cannot be run as given; the text says what would work."""


class DemoError(Exception):
    """A process of the demo failed; the text names it and where to look."""


class MemoryFileError(Exception):
    """A file of remembered things is damaged, of another version or robot, or cannot be written."""
