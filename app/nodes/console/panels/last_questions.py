"""What was searched for last from the Search tab, so that a second press is no second search."""

from typing import Final

from app.messages.status import Status

Question = tuple[str, str, str]
"""What is typed as object, context and scenario."""
_GO_ON: Final = ("queued", "active")


class LastQuestion:
    """Tells whether a question is asked again while its goals go on; for one thread at a time."""

    def __init__(self) -> None:
        self._asked: Question | None = None
        self._goals: set[int] = set()
        self._was_told = False
        self._status: Status | None = None

    def follow(self, status: Status) -> None:
        """Take over how far the goals are."""
        self._status = status

    def repeats(self, question: Question) -> bool:
        """Return whether a question is searched for already; once only, so that it can be meant."""
        if question != self._asked or self._was_told or not self._goes_on():
            return False
        self._was_told = True
        return True

    def is_outdated(self) -> bool:
        """Return whether the question is over and another goal runs; once for each question."""
        goal = None if self._status is None else self._status.goal
        is_other = goal is not None and goal.outcome == "active" and goal.goal_id not in self._goals
        if self._asked is None or not is_other or self._goes_on():
            return False
        self._asked = None
        return True

    def accepted(self, question: Question, goals: set[int]) -> None:
        """Note the goals of a question."""
        self._asked, self._goals, self._was_told = question, goals, False

    def _goes_on(self) -> bool:
        status = self._status
        if status is None:
            return True
        known = [*status.history, *status.tour, *filter(None, [status.goal])]
        over = {goal.goal_id for goal in known if goal.outcome not in _GO_ON}
        return bool(self._goals - over)
