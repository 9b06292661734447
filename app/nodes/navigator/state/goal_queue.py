"""The active goal, the queued goals and the finished ones."""

import dataclasses
import threading
from collections.abc import Callable
from typing import Literal

from app.messages.status import GoalOutcome, GoalStatus
from ippon.guidance.language.naming import ResolvedObject
from ippon.guidance.levels import Guidance, LabelLevel
from ippon.mission.goal import Goal

Outcome = Literal["found", "out_of_reach", "exhausted", "cancelled"]
HISTORY = 50


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class PlannedSearch:
    """A goal and its current levels."""

    goal: Goal
    resolved: ResolvedObject
    scenario: str = ""
    guidance: Guidance
    elapsed_ms: float
    """Time that the levels took."""
    edits: tuple[LabelLevel, ...] = ()
    """Levels that the operator set; they override every answer."""
    questions: int = 0
    """Number of questions to a language model; answers to earlier ones are discarded."""
    asking: str = ""
    """Language model whose answer is pending."""
    failed: str = ""
    """Why the language model gave no answer."""
    from_cache: bool = False
    prompt: str = ""
    """The exact question to the language model."""
    reply: str = ""
    """Its exact answer."""
    asked_at: float = 0.0
    """Monotonic time of the request."""
    waited: bool = False
    """Whether the goal was queued behind others."""


class GoalQueue:
    """Numbers and orders the goals; safe from any thread."""

    def __init__(self, max_queue: int) -> None:
        self._lock = threading.Lock()
        self._max_queue = max_queue
        self._next_id = 1
        self._active: PlannedSearch | None = None
        self._active_is_over: Outcome | None = None
        self._queue: list[PlannedSearch] = []
        self._history: list[GoalStatus] = []

    def add(self, search: PlannedSearch) -> tuple[int, int] | None:
        """Queue a search; return its number and place, None if too many are waiting."""
        with self._lock:
            if len(self._queue) >= self._max_queue:
                return None
            goal_id = self._next_id
            self._next_id += 1
            goal = dataclasses.replace(search.goal, goal_id=goal_id)
            busy = self._active is not None and self._active_is_over is None
            position = len(self._queue) + (1 if busy else 0)
            self._queue.append(dataclasses.replace(search, goal=goal, waited=position > 0))
            return goal_id, position

    def next(self, *, hold: bool = False) -> PlannedSearch | None:
        """Activate the first waiting goal if none is active; return it.

        Args:
            hold: A find waits to be confirmed: queued goals do not start yet.
        """
        with self._lock:
            if not self._queue or (self._active is not None and self._active_is_over is None):
                return None
            has_find = self._active_is_over in {"found", "out_of_reach"}
            if hold and has_find and self._queue[0].waited:
                return None
            self._archive()
            self._active = self._queue.pop(0)
            self._active_is_over = None
            return self._active

    def active(self) -> PlannedSearch | None:
        """Return the active goal, or the last one."""
        with self._lock:
            return self._active

    def unfinished(self) -> list[PlannedSearch]:
        """Return the active goal, unless it has ended, and the waiting ones."""
        with self._lock:
            searched = self._active is not None and self._active_is_over is None
            return [*([self._active] if searched and self._active else []), *self._queue]

    def find(self, goal_id: int) -> PlannedSearch | None:
        """Return an active, last or waiting goal by its number."""
        with self._lock:
            known = (*([self._active] if self._active else []), *self._queue)
            return next((s for s in known if s.goal.goal_id == goal_id), None)

    def amend(
        self, goal_id: int, change: Callable[[PlannedSearch], PlannedSearch]
    ) -> PlannedSearch | None:
        """Replace fields of a goal; return it, None if it has ended and is no longer shown."""
        with self._lock:
            if self._active is not None and self._active.goal.goal_id == goal_id:
                self._active = change(self._active)
                return self._active
            for place, search in enumerate(self._queue):
                if search.goal.goal_id == goal_id:
                    self._queue[place] = change(search)
                    return self._queue[place]
            return None

    def move_first(self, goal_id: int) -> bool:
        """Move a waiting goal to the front; return whether it exists."""
        with self._lock:
            chosen = [s for s in self._queue if s.goal.goal_id == goal_id]
            self._queue = chosen + [s for s in self._queue if s.goal.goal_id != goal_id]
            return bool(chosen)

    def remove(self, goal_id: int) -> bool:
        """Cancel a waiting goal; return whether it exists."""
        with self._lock:
            chosen = [s for s in self._queue if s.goal.goal_id == goal_id]
            self._queue = [s for s in self._queue if s.goal.goal_id != goal_id]
            gone = [_status(s.goal, "cancelled") for s in chosen]
            self._history = [*self._history, *gone][-HISTORY:]
            return bool(chosen)

    def conclude(self, outcome: Outcome) -> None:
        """End the active goal; it is shown until the next one starts.

        A cancelled goal is archived at once, with its earlier outcome, if any.
        """
        with self._lock:
            if outcome == "cancelled":
                self._archive()
                self._active, self._active_is_over = None, None
            else:
                self._active_is_over = outcome

    def reopen(self) -> None:
        """Reactivate the last goal after its find was rejected."""
        with self._lock:
            self._active_is_over = None

    def statuses(self) -> tuple[GoalStatus | None, list[GoalStatus], list[GoalStatus]]:
        """Return the active goal, the waiting ones and the finished ones."""
        with self._lock:
            active = None
            if self._active is not None:
                active = _status(self._active.goal, self._active_is_over or "active")
            queue = [_status(search.goal, "queued") for search in self._queue]
            return active, queue, list(self._history)

    def _archive(self) -> None:
        if self._active is not None:
            status = _status(self._active.goal, self._active_is_over or "cancelled")
            self._history = [*self._history, status][-HISTORY:]


def _status(goal: Goal, outcome: GoalOutcome) -> GoalStatus:
    return GoalStatus(
        goal_id=goal.goal_id, object=goal.object, context=goal.context, outcome=outcome
    )
