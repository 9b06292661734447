"""Requests about goals: search, stop, resume, pause, cancel, confirm or reject a find."""

import time
from functools import partial
from typing import Protocol

from app.links.network.requests import RequestRefusedError
from app.messages.control import (
    Accepted,
    ControlReply,
    ControlRequest,
    FeedbackRequest,
    SearchAccepted,
    SearchRequest,
)
from app.messages.plain_text import complaint
from app.messages.status import MissionState
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.state.goal_queue import GoalQueue, PlannedSearch
from ippon.guidance.language.requests.sentence import name_notes
from ippon.mission.mission import Mission


class StopLatch(Protocol):
    """Holds the robot at zero speed until released; safe from any thread."""

    @property
    def halts(self) -> int:
        """Number of halts so far."""
        ...

    def halt(self) -> None:
        """Send zero, whatever is commanded, until `release`."""
        ...

    def release(self, if_count: int) -> bool:
        """Pass commands again, if `halts` is still `if_count`; return whether they pass."""
        ...


class GoalService:
    """Validates requests in zenoh's threads and queues operations for the mission."""

    def __init__(
        self,
        goals: GoalQueue,
        guidance: GuidanceService,
        *,
        stop_latch: StopLatch,
        operations: OperationQueue,
    ) -> None:
        self._guidance = guidance
        self._goals = goals
        self._stop_latch = stop_latch
        self._operations = operations
        self.state: MissionState = "starting"
        """State of the latest status; the navigator sets it."""

    def search(self, request: SearchRequest) -> SearchAccepted:
        """Plan a search on the embedded prior and queue its goal."""
        if not request.object.strip():
            raise RequestRefusedError('the object is empty; name an object, such as "hat"')
        for what in ("object", "context", "scenario"):
            problem = complaint(f"the {what}", getattr(request, what))
            if problem is not None:
                raise RequestRefusedError(problem)
        search = self._guidance.plan(request, time.monotonic())
        place = self._goals.add(search)
        if place is None:
            raise RequestRefusedError("too many goals are waiting; cancel some first")
        goal_id, position = place
        self._guidance.consult(goal_id)
        self._operations.wake()
        return SearchAccepted(
            goal_id=goal_id,
            object=search.goal.object,
            position=max(0, position),
            notes=[*name_notes(request.object), *search.guidance.notes],
        )

    def control(self, request: ControlRequest) -> ControlReply:
        """Stop, resume, pause or cancel."""
        detail = ""
        match request.action:
            case "stop":
                # The robot stops at once; the mission is told between two frames.
                self._stop_latch.halt()
                self._operations.enqueue(self._stop)
                state: MissionState = "stopped"
            case "pause":
                self._operations.enqueue(lambda mission: mission.operator.pause())
                state = "paused"
            case "resume":
                self._operations.enqueue(partial(self._resume, self._stop_latch.halts))
                state = "searching" if self._goals.active() is not None else "starting"
            case "cancel":
                goal, _, _ = self._goals.statuses()
                if goal is None:
                    raise RequestRefusedError("there is no goal to cancel")
                if goal.outcome != "active":
                    detail = f"the search for {goal.object} had ended: {goal.outcome}"
                self._operations.enqueue(partial(self._cancel, goal.goal_id))
                state = self.state if self.state == "stopped" else "starting"
        return ControlReply(state=state, detail=detail)

    def feedback(self, request: FeedbackRequest) -> Accepted:
        """Confirm or reject a find."""
        if self.state != "found":
            raise RequestRefusedError("there is no find to confirm or reject")
        if request.verdict == "confirm":
            self._operations.enqueue(self._confirm)
            return Accepted(detail="confirmed")

        self._operations.enqueue(self._reject)
        return Accepted(detail="the search continues; this find is excluded")

    # -- in the mission's thread -------------------------------------------------------------

    def _stop(self, mission: Mission) -> None:
        mission.operator.stop()

    def _confirm(self, mission: Mission) -> None:
        mission.goals.confirm_find()

    def _resume(self, halts: int, mission: Mission) -> None:
        # A stop that came after this resume prevails; its operation is queued next.
        if self._stop_latch.release(if_count=halts):
            mission.operator.resume()

    def _cancel(self, goal_id: int, mission: Mission) -> None:
        if self._still_active(goal_id) is not None:
            self._goals.conclude("cancelled")
            mission.goals.cancel_goal()

    def _reject(self, mission: Mission) -> None:
        if mission.goals.reject_find():
            self._goals.reopen()

    def _still_active(self, goal_id: int) -> PlannedSearch | None:
        """Return the goal of a request, None when it is no longer the active one."""
        active = self._goals.active()
        return active if active is not None and active.goal.goal_id == goal_id else None
