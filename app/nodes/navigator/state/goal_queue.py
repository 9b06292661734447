"""The active goals, the queued goals and the finished ones."""

import dataclasses
import threading
from collections.abc import Callable, Sequence
from typing import Final

from app.messages.status import GoalOutcome, GoalStatus
from app.nodes.navigator.state.planned_search import (
    FOUND,
    End,
    EndedGoal,
    Outcome,
    Place,
    PlannedSearch,
    goal_status,
    judged,
)
from app.nodes.navigator.state.waiting_goals import edited, moved, tour_to_join
from ippon.mission.snapshot import Find, GoalState
from ippon.mission.snapshot import GoalStatus as TourGoal

HISTORY = 50
JOIN_S: Final = 10.0
"""Time from the start of a search in which a goal may join it: the tour starts anew with both, and
what images have shown of the first object is lost."""


class GoalQueue:
    """Numbers and orders the goals; safe from any thread.

    Goals of one tour are active together, and one of them leads. Outside of tours one goal is
    active, and it leads.
    """

    def __init__(self, max_queue: int) -> None:
        self._lock = threading.Lock()
        self._max_queue = max_queue
        self._next_id = 1
        self._active: list[PlannedSearch] = []
        self._ends: dict[int, End] = {}
        """The ends of active goals by number; they stay active until the next ones start."""
        self._finds: list[int] = []
        """Active goals whose finds are neither confirmed nor rejected, the latest last."""
        self._lead = 0
        self._started_at = 0.0
        self._queue: list[PlannedSearch] = []
        self._history: list[EndedGoal] = []
        self.elapsed_s = 0.0
        """Robot time since the active goals were set; the mission's thread sets it."""

    def add(
        self, search: PlannedSearch, joins: int | None = None, *, restores: bool = False
    ) -> Place | None:
        """Queue a search; return its number and place, None if there is no place for it.

        Args:
            search: The search; `asked_at` is the present time.
            joins: Number of a goal to be searched for in one tour with it. If that is not possible,
                the search waits as the next one, and the note of its place says why.
            restores: It is of an earlier run, whose active goals wait, too: there is always place.

        A copy of what is searched for or waits as the same copy is not queued again.
        """
        with self._lock:
            copies = (one for one in self._unfinished() if one.copy_of == search.copy_of)
            copy = next(copies, None) if search.copy_of else None
            if copy is not None:
                note = f"goal {copy.goal.goal_id} searches for it already"
                return Place(copy.goal.goal_id, 0, None, note, is_new=False)
            is_full = len(self._queue) >= self._max_queue and not restores
            if is_full or (search.if_idle and self._unfinished()):
                return None
            goal_id = self._next_id
            self._next_id += 1
            tour, note = (None, "") if joins is None else self._tour_to_join(search, joins)
            goal = dataclasses.replace(search.goal, goal_id=goal_id)
            place = len(self._queue)
            position = place + (1 if self._is_busy() else 0)
            if tour is not None:
                # Behind those of its tour: at the front for the running one.
                waiting = [n for n, one in enumerate(self._queue) if one.tour == tour]
                place = waiting[-1] + 1 if waiting else 0
                position = 0 if self._runs(tour) else waiting[0] + (1 if self._is_busy() else 0)
            queued = dataclasses.replace(
                search, goal=goal, waited=position > 0, tour=goal_id if tour is None else tour
            )
            self._queue.insert(place, queued)
            return Place(goal_id, position, tour, note)

    def next(self, now: float = 0.0, *, hold: bool = False) -> tuple[PlannedSearch, ...]:
        """Activate the first waiting goal, with its tour, if none is active.

        Goals that join the running tour are activated at once.

        Args:
            now: Monotonic time.
            hold: A find waits to be confirmed: queued goals do not start yet.

        Returns:
            The goals to search for from now on; empty if the search does not change.
        """
        with self._lock:
            if not self._queue:
                return ()
            first = self._queue[0]
            if self._is_busy():
                if not self._runs(first.tour) or self._ends:
                    return ()
            else:
                has_find = any(end.outcome in FOUND for end in self._ends.values())
                if hold and has_find and first.waited:
                    return ()
                self._archive(self._active)
                self._active, self._ends, self._finds, self.elapsed_s = [], {}, [], 0.0
                self._lead, self._started_at = first.goal.goal_id, now
            self._active += [one for one in self._queue if one.tour == first.tour]
            self._queue = [one for one in self._queue if one.tour != first.tour]
            return tuple(self._active)

    def active(self) -> PlannedSearch | None:
        """Return the leading active goal, or the last one."""
        with self._lock:
            return self._leading()

    def is_active(self, goal_id: int) -> bool:
        """Return whether a goal is active, or among the last ones."""
        with self._lock:
            return any(one.goal.goal_id == goal_id for one in self._active)

    def in_tour(self) -> bool:
        """Return whether several goals are active."""
        with self._lock:
            return len(self._active) > 1

    def unfinished(self) -> list[PlannedSearch]:
        """Return the active goals that have not ended, and the waiting ones."""
        with self._lock:
            return self._unfinished()

    def find(self, goal_id: int) -> PlannedSearch | None:
        """Return an active, last or waiting goal by its number."""
        with self._lock:
            known = (*self._active, *self._queue)
            return next((s for s in known if s.goal.goal_id == goal_id), None)

    def amend(
        self, goal_id: int, change: Callable[[PlannedSearch], PlannedSearch]
    ) -> PlannedSearch | None:
        """Replace fields of a goal; return it, None if it has ended and is no longer shown."""
        with self._lock:
            for goals in (self._active, self._queue):
                for place, search in enumerate(goals):
                    if search.goal.goal_id == goal_id:
                        goals[place] = change(search)
                        return goals[place]
            return None

    def move_first(self, goal_id: int) -> bool:
        """Move a waiting goal, with its tour, to the front; return whether it exists."""
        with self._lock:
            if not self._queue:
                return False
            self._queue, missing = moved(self._queue, goal_id, self._queue[0].goal.goal_id)
            return missing is None

    def move_before(self, goal_id: int, before: int) -> int | None:
        """Move a waiting goal, with its tour, before another one.

        Returns:
            Which of the two does not wait any more; None if both do.
        """
        with self._lock:
            self._queue, missing = moved(self._queue, goal_id, before)
            return missing

    def edit(self, goal_id: int, search: PlannedSearch) -> bool:
        """Replace object and context of a waiting goal, which keeps its number and its place.

        Returns:
            Whether it still waits.

        Raises:
            ValueError: Another goal of its tour is the same object.
        """
        with self._lock:
            self._queue, waits = edited(self._queue, goal_id, search)
            return waits

    def ended(self, goal_id: int) -> PlannedSearch | None:
        """Return a goal whose search has ended, by its number."""
        with self._lock:
            last = [one for one in self._active if one.goal.goal_id in self._ends]
            known = (*last, *(one.search for one in self._history))
            return next((one for one in known if one.goal.goal_id == goal_id), None)

    def remove(self, goal_id: int) -> bool:
        """Cancel a waiting goal; return whether it exists."""
        with self._lock:
            chosen = [s for s in self._queue if s.goal.goal_id == goal_id]
            self._queue = [s for s in self._queue if s.goal.goal_id != goal_id]
            self._archive(chosen)
            return bool(chosen)

    def conclude(
        self,
        outcome: Outcome,
        goal_id: int | None = None,
        find: Find | None = None,
    ) -> None:
        """End an active goal; it is shown until the next one starts.

        A cancelled goal is archived at once, with its earlier outcome, if any.

        Args:
            outcome: How its search ended.
            goal_id: Its number; None for the leading goal, or all of a tour that is cancelled.
            find: What was found.
        """
        with self._lock:
            if outcome == "cancelled":
                gone = [one for one in self._active if goal_id in (None, one.goal.goal_id)]
                self._archive(gone)
                self._active = [one for one in self._active if one not in gone]
                for one in gone:
                    self._reopen(one.goal.goal_id)
                return
            ended = self._lead if goal_id is None else goal_id
            self._ends[ended] = End.of(outcome, find, self.elapsed_s)
            if outcome in FOUND:
                self._finds.append(ended)

    def note_finds(self, goal_id: int, counted: Sequence[Find], rejected: Sequence[Find]) -> None:
        """Note the finds of a goal that count, without the present one, and the rejected ones."""
        finds = {"counted": tuple(counted), "rejected": tuple(rejected)}
        known = self.find(goal_id)
        if known is not None and (known.counted, known.rejected) != tuple(finds.values()):
            self.amend(goal_id, lambda one: dataclasses.replace(one, **finds))

    def judged(self, goal_id: int | None, number: int) -> tuple[int, bool] | None:
        """Return the active goal of a find, and whether it ended the search; None without one."""
        with self._lock:
            return judged(self._active, self._ends, goal_id, number)

    def follow_tour(self, lead: int, tour: Sequence[TourGoal]) -> list[int]:
        """Take over which goal leads, and which goals of the tour have ended.

        Args:
            lead: Number of the leading goal.
            tour: The goals of the tour, as the mission reports them.

        Returns:
            Numbers of the goals that have ended since the last call.
        """
        with self._lock:
            self._lead = lead
            ends = dict(self._ends)
        ended: list[int] = []
        for one in tour:
            goal_id, find = one.goal.goal_id, one.find
            if not self.is_active(goal_id):
                continue
            self.note_finds(goal_id, one.counted, one.rejected)
            if one.state is GoalState.MISSING and goal_id in ends:
                self.reopen(goal_id)
            elif goal_id not in ends and one.state is GoalState.NOT_FOUND:
                self.conclude("exhausted", goal_id)
                ended.append(goal_id)
            elif goal_id not in ends and one.state is GoalState.FOUND and find is not None:
                outcome = "found" if find.out_of_reach_m is None else "out_of_reach"
                self.conclude(outcome, goal_id, find)
                ended.append(goal_id)
        return ended

    def reopen(self, goal_id: int | None = None) -> None:
        """Reactivate a goal; None for the leading one."""
        goal_id = self._lead if goal_id is None else goal_id
        with self._lock:
            self._reopen(goal_id)
        self.amend(goal_id, lambda one: dataclasses.replace(one, confirmed=False))

    def announced(self, goal_id: int | None = None) -> int | None:
        """Return the goal whose find was announced last and is neither confirmed nor rejected.

        Args:
            goal_id: The only goal that is asked about; None for any.
        """
        with self._lock:
            finds = (one for one in reversed(self._finds) if goal_id in (None, one))
            return next(finds, None)

    def confirm(self, goal_id: int) -> None:
        """Note that the find of a goal was confirmed."""
        with self._lock:
            self._finds = [one for one in self._finds if one != goal_id]
        self.amend(goal_id, lambda one: dataclasses.replace(one, confirmed=True))

    def statuses(self) -> tuple[GoalStatus | None, list[GoalStatus], list[GoalStatus]]:
        """Return the leading active goal, the waiting ones and the finished ones."""
        with self._lock:
            lead = self._leading()
            active = None if lead is None else self._status(lead, "active")
            queue = [self._status(search, "queued") for search in self._queue]
            return active, queue, [one.status for one in self._history]

    def tour(self) -> list[GoalStatus]:
        """Return the goals of the present tour, or the last one; empty for one goal."""
        with self._lock:
            goals = [self._status(search, "active") for search in self._active]
            return goals if len(goals) > 1 else []

    # -- with the lock held ------------------------------------------------------------------

    def _unfinished(self) -> list[PlannedSearch]:
        searched = [one for one in self._active if one.goal.goal_id not in self._ends]
        return [*searched, *self._queue]

    def _is_busy(self) -> bool:
        return any(one.goal.goal_id not in self._ends for one in self._active)

    def _runs(self, tour: int) -> bool:
        return self._is_busy() and any(one.tour == tour for one in self._active)

    def _leading(self) -> PlannedSearch | None:
        lead = (one for one in self._active if one.goal.goal_id == self._lead)
        return next(lead, self._active[0] if self._active else None)

    def _tour_to_join(self, search: PlannedSearch, joins: int) -> tuple[int | None, str]:
        """Return the tour of a goal to join; None and the reason if that is not possible."""
        late = search.asked_at - self._started_at > JOIN_S or bool(self._ends)
        return tour_to_join(search, joins, self._queue, self._active, late=late)

    def _reopen(self, goal_id: int) -> None:
        self._ends.pop(goal_id, None)
        self._finds = [one for one in self._finds if one != goal_id]

    def _archive(self, goals: Sequence[PlannedSearch]) -> None:
        gone = [EndedGoal(search, self._status(search, "cancelled")) for search in goals]
        self._history = [*self._history, *gone][-HISTORY:]

    def _status(self, search: PlannedSearch, running: GoalOutcome) -> GoalStatus:
        """Return the status of a goal, with an outcome for one that has not ended."""
        end = self._ends.get(search.goal.goal_id)
        is_cancelled = end is None and running == "cancelled"
        if is_cancelled and search in self._active:
            end = End("cancelled", None, self.elapsed_s)
        in_tour = any(
            one.tour == search.tour and one is not search for one in (*self._active, *self._queue)
        )
        return goal_status(search, running, end, in_tour=in_tour)
