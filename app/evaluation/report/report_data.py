"""Everything that the report of an evaluation shows."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ippon.evaluation.row import EpisodeRow
from ippon.evaluation.summary import Comparison, Effect, MethodSummary


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportData:
    """Everything that the page shows."""

    rows: Sequence[EpisodeRow]
    summaries: Sequence[MethodSummary]
    comparisons: Sequence[Comparison]
    later: Sequence[EpisodeRow]
    """Searches for a second object and those that they are compared with; in no table of means."""
    contexts: Sequence[Effect]
    """With a truthful sentence, and without."""
    seconds: Sequence[Effect]
    """A second object on the map of the first, and on an empty one."""
    errors: Sequence[str]
    settings: dict[str, Any]
    folder: Path
    """Where the results lie, for commands and links."""
