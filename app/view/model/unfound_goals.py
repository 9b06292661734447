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
    also: tuple[GoalStatus, ...] = ()
    """Other goals of its tour that ended with it."""

    @property
    def goals(self) -> tuple[GoalStatus, ...]:
        """All of them."""
        return (self.goal, *self.also)


class UnfoundGoals:
    """Remembers what was not found while the robot goes on with the next goal.

    The map's probabilities are those of the next goal soon after, so the places are looked up with
    the status that tells of the end.
    """

    def __init__(self) -> None:
        self.latest: UnfoundGoal | None = None
        """None once it is searched for again or dismissed, or a later find is confirmed."""
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
        news = [goal for goal in ended if goal.goal_id not in self._known]
        if news:
            self.latest = _told(news, status, candidates)
        # A navigator that was started again counts from 1.
        going = {goal.goal_id for goal in present if goal.outcome == "active" and goal not in ended}
        if self.latest is not None and self.latest.goal.goal_id in going:
            self.latest = None
        self._known = (self._known - going) | {goal.goal_id for goal in ended}
        if self.latest is not None and _is_past(self.latest.goal, [*status.history, *present]):
            self.latest = None

    def dismiss(self, lost: UnfoundGoal) -> None:
        """Forget a goal that somebody has read about; another one of its number stays.

        A navigator that was started again counts from 1, and a review shows one end several times.
        """
        if self.latest is not None and _end_of(self.latest.goal) == _end_of(lost.goal):
            self.latest = None


def _told(
    news: list[GoalStatus], status: Status, candidates: Callable[[], tuple[Candidate, ...]]
) -> UnfoundGoal:
    """Return what ended: of a tour, the places are those of the goal that the map shows."""
    shown = None if status.goal is None else status.goal.goal_id
    goal = next((one for one in news if one.goal_id == shown), news[-1])
    also = [one for one in news if one is not goal and goal.tour and one.tour == goal.tour]
    is_shown = status.state == "exhausted" and goal.goal_id == shown
    return UnfoundGoal(
        goal=goal,
        places=candidates() if is_shown else None,
        start_ns=status.stamp_ns - int(status.elapsed_s * 1e9),
        also=tuple(also),
    )


def _end_of(goal: GoalStatus) -> tuple[int, str, float | None]:
    return goal.goal_id, goal.object, goal.took_s


def _is_past(lost: GoalStatus, goals: list[GoalStatus]) -> bool:
    later = [one for one in goals if one.goal_id > lost.goal_id]
    return any(one.object == lost.object or one.confirmed for one in later)
