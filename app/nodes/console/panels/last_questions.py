"""What was searched for last from the Search tab, so that a second press is no second search."""

from dataclasses import dataclass
from typing import Final

from app.messages.status import Status

Question = tuple[str, str, str]
"""What is typed as object, context and scenario."""
_GO_ON: Final = ("queued", "active")


@dataclass(slots=True)
class _Asked:
    goals: set[int]
    words: tuple[str, str]
    was_told: bool = False


class LastQuestions:
    """Tells whether a question is asked again while its goals go on; for one thread at a time."""

    def __init__(self) -> None:
        self._asked: dict[Question, _Asked] = {}
        self._status: Status | None = None

    def follow(self, status: Status) -> None:
        """Take over how far the goals are."""
        self._status = status

    def repeats(self, question: Question) -> bool:
        """Return whether a question is searched for already; once only, so that it can be meant."""
        asked = self._asked.get(question)
        if asked is None or asked.was_told or not self._go_on(asked.goals):
            return False
        asked.was_told = True
        return True

    def take_outdated(self) -> list[tuple[str, str]]:
        """Return the words of questions that are over while another goal runs; each once.

        Words that are searched for still, in another scenario, are left out.
        """
        goal = None if self._status is None else self._status.goal
        if goal is None or goal.outcome != "active":
            return []
        over = [
            question
            for question, asked in self._asked.items()
            if goal.goal_id not in asked.goals and not self._go_on(asked.goals)
        ]
        ended = [self._asked.pop(question).words for question in over]
        going = {asked.words for asked in self._asked.values()}
        return [words for words in ended if words not in going]

    def accepted(self, question: Question, goals: set[int], words: tuple[str, str]) -> None:
        """Note the goals of a question.

        Args:
            question: What was asked.
            goals: Their numbers.
            words: What stands in the fields for object and context.
        """
        self._asked[question] = _Asked(goals, words)

    def _go_on(self, goals: set[int]) -> bool:
        status = self._status
        if status is None:
            return True
        known = [*status.history, *status.tour, *filter(None, [status.goal])]
        return bool(goals - {goal.goal_id for goal in known if goal.outcome not in _GO_ON})
