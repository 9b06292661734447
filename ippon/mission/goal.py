"""What is searched for."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """One object of interest."""

    goal_id: int
    object: str
    """Canonical label: what the segmentation is asked for."""
    display: str
    """The operator's own words, for the screen."""
    context: str = ""
    category: str | None = None
    """The common object that it is an instance of, where one is known."""
