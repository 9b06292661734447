"""Data of an evaluation's report."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ippon.evaluation.row import EpisodeRow
from ippon.evaluation.summary import Comparison, Effect, Losses, MethodSummary, Part


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportData:
    """Data of the report."""

    rows: Sequence[EpisodeRow]
    """Single searches of the folder, and of those pooled with it."""
    folders: Mapping[tuple[str, str], Path]
    """Folder of each row, by episode and method."""
    compared: Sequence[EpisodeRow]
    """These and those of other folders, whose methods are named with their folder."""
    other_settings: Sequence[str]
    """What was set otherwise in the other folders."""
    summaries: Sequence[MethodSummary]
    parts: Sequence[Part]
    """By shortest path and by kind of object."""
    losses: Sequence[Losses]
    """Where SPL is lost."""
    comparisons: Sequence[Comparison]
    """Of the reference with each other method, on the same episodes."""
    reference: str
    later: Sequence[EpisodeRow]
    """Searches for a second object and their counterparts; not in the tables of means."""
    contexts: Sequence[Effect]
    """Effect of a correct sentence."""
    seconds: Sequence[Effect]
    """Effect of an existing map on the search for a second object."""
    unruled: Mapping[str, float]
    """Share of steps in which the rule of a method gave no target, by method."""
    errors: Sequence[str]
    settings: dict[str, Any]
    folder: Path
    """Folder that the report is written into."""
