"""What a reader of an evaluation's figures must know, on the page and in the terminal."""

from collections.abc import Iterable
from typing import Final, NamedTuple

from app.evaluation.report.report_data import ReportData
from app.evaluation.version import program_of
from ippon.evaluation.methods.rule_share import MOSTLY, rule_note

ENOUGH_HOMES: Final = 10
"""Number of homes below which a bootstrap over homes is too narrow."""
ENOUGH_EPISODES: Final = 200
"""Number of episodes below which a sample is said to be small."""


class ReportWarning(NamedTuple):
    """One of them."""

    text: str
    minor: bool = False
    """The figures stand without it."""


def warnings_of(data: ReportData) -> Iterable[ReportWarning]:
    """Yield all but the episodes that failed with an error, which are a list."""
    for method, share in data.unruled.items():
        if share > 0.0:
            yield ReportWarning(rule_note(method, share), minor=share <= MOSTLY)
    if min(s.episodes for s in data.summaries) < ENOUGH_EPISODES:
        yield ReportWarning(
            f"small sample, fewer than {ENOUGH_EPISODES} episodes for some method: read the "
            "intervals, not the means"
        )
    fewest = min(s.homes for s in data.summaries)
    if fewest < ENOUGH_HOMES:
        yield ReportWarning(
            f"intervals over fewer than {ENOUGH_HOMES} homes are too narrow; a method has {fewest}"
        )
    if len({s.episodes for s in data.summaries}) > 1:
        yield ReportWarning(
            "methods ran different numbers of episodes; only the paired table compares the same "
            "ones"
        )
    for difference in data.other_settings:
        yield ReportWarning(f"other settings: {difference}")
    if len({program_of(row.version) for row in data.rows}) > 1:
        yield ReportWarning("rows were made by different versions of the program")
