"""The goal that ended last without a find, with the likeliest places of its object."""

from collections.abc import Callable
from dataclasses import dataclass

from app.messages.status import GoalStatus, Status
from app.view.model.candidates import Candidate


@dataclass(frozen=True, slots=True, kw_only=True)
class UnfoundGoal:
    """A goal whose object was not found."""

    goal: GoalStatus
    places: tuple[Candidate, ...] | None
    """Where its object may be, the likeliest first; None if it came too late."""
    start_ns: int
    """Robot time at which its search began."""


class UnfoundGoals:
    """Remembers what was not found while the robot goes on with the next goal.

    The map's probabilities are those of the next goal soon after, so the places are looked up with
    the status that tells of the end.
    """

    def __init__(self) -> None:
        self.latest: UnfoundGoal | None = None
        """None once the object is searched for again."""
        self._known: set[int] | None = None

    def follow(self, status: Status, candidates: Callable[[], tuple[Candidate, ...]]) -> None:
        """Take over which goals have ended without a find.

        Args:
            status: The latest status.
            candidates: Returns the likeliest places in the map as it is.
        """
        is_over = status.state == "exhausted"
        present = status.tour or [goal for goal in (status.goal,) if goal is not None]
        ended = [goal for goal in (*status.history, *present) if goal.outcome == "exhausted"]
        if is_over and not ended and status.goal is not None:
            ended = [status.goal]
        if self._known is None:
            # What ended before the first status is no news.
            self._known = {goal.goal_id for goal in ended if goal not in present}
        for goal in ended:
            if goal.goal_id not in self._known:
                self.latest = UnfoundGoal(
                    goal=goal,
                    places=candidates() if is_over else None,
                    start_ns=status.stamp_ns - int(status.elapsed_s * 1e9),
                )
        self._known |= {goal.goal_id for goal in ended}
        if self.latest is not None and _is_again(self.latest.goal, present):
            self.latest = None


def _is_again(lost: GoalStatus, present: list[GoalStatus]) -> bool:
    return any(one.object == lost.object and one.goal_id != lost.goal_id for one in present)
