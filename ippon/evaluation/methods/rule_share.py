"""How much of a method's searches its rule decided, and how much IPPON's own planner."""

from collections.abc import Iterable
from typing import Final

from ippon.evaluation.row import EpisodeRow

MOSTLY: Final = 0.5
"""Share of steps without a target of the rule above which the figures are not those of the rule."""


def unruled_shares(rows: Iterable[EpisodeRow]) -> dict[str, float]:
    """Return, for each method with a rule, the share of steps in which it gave no target."""
    asked: dict[str, int] = {}
    unruled: dict[str, int] = {}
    for row in rows:
        if row.rule_steps > 0:
            asked[row.method] = asked.get(row.method, 0) + row.rule_steps
            unruled[row.method] = unruled.get(row.method, 0) + row.unruled_steps
    return {method: unruled[method] / asked[method] for method in asked}


def rule_note(method: str, share: float) -> str:
    """Return what a share of `unruled_shares` means, in a sentence."""
    text = (
        f"{method}: in {100.0 * share:.0f} % of the steps in which it was asked, its rule gave no "
        "target within reach, and the planner of ippon chose"
    )
    if share > MOSTLY:
        text += "; its figures are mostly those of that planner"
    return text
