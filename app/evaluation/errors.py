"""Errors of an evaluation."""

from app.errors import UsageError


class EvaluationError(UsageError):
    """The evaluation cannot be run, read or repeated; the text says what would work."""
