"""What a command says when it cannot do what it was asked."""


class UsageError(Exception):
    """The command was asked for something impossible; its text says what would work."""


class DemoError(Exception):
    """A part of the demo failed; the text says which and what to look at."""
