"""The navigator's counter: requests in, answers at once, work for the mission's thread."""

import logging
import queue
import time
from collections.abc import Callable
from functools import partial
from typing import Protocol

import zenoh

from app.links.network.requests import Authorize, RequestRefusedError, allow_all, serve
from app.messages import keys
from app.messages.control import (
    Accepted,
    ControlReply,
    ControlRequest,
    FeedbackRequest,
    MissionState,
    SearchAccepted,
    SearchRequest,
)
from app.messages.plain_text import complaint
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.state.goal_queue import GoalQueue, PlannedSearch
from ippon.mission.mission import Mission

logger = logging.getLogger(__name__)

Operation = Callable[[Mission], None]


class StopLatch(Protocol):
    """What a stop reaches at once; safe from any thread."""

    @property
    def halts(self) -> int:
        """How often they were halted so far."""
        ...

    def halt(self) -> None:
        """Stand, whatever is commanded, until `release`."""
        ...

    def release(self, if_count: int) -> bool:
        """Take commands again, unless there was another halt after the `if_count`th."""
        ...


class GoalService:
    """Validates and queues; the mission's thread runs what was queued between two frames."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        goals: GoalQueue,
        counsel: GuidanceService,
        *,
        wheels: StopLatch,
        wake: Callable[[], None],
        authorize: Authorize = allow_all,
    ) -> None:
        self._counsel = counsel
        self._goals = goals
        self._wheels = wheels
        self._wake = wake
        self._operations: queue.SimpleQueue[Operation] = queue.SimpleQueue()
        self.state: MissionState = "starting"
        """State that a control request is answered with; kept up to date by the node."""
        self._queryables = [
            serve(session, f"{robot}/{keys.SEARCH}", SearchRequest, self.search, authorize),
            serve(session, f"{robot}/{keys.CONTROL}", ControlRequest, self.control, authorize),
            serve(session, f"{robot}/{keys.FEEDBACK}", FeedbackRequest, self.feedback, authorize),
        ]

    def run_queued(self, mission: Mission) -> None:
        """Run what was queued, in order. Called by the mission's thread."""
        while True:
            try:
                operation = self._operations.get_nowait()
            except queue.Empty:
                return
            try:
                operation(mission)
            except Exception:  # One request that goes wrong must not end the navigator.
                logger.exception("a request failed")

    def put(self, operation: Operation) -> None:
        """Queue something for the mission's thread."""
        self._operations.put(operation)
        self._wake()

    def search(self, request: SearchRequest) -> SearchAccepted:
        """Take a goal over."""
        if not request.object.strip():
            raise RequestRefusedError('the object is empty; say what to look for, like "hat"')
        for what in ("object", "context", "scenario"):
            problem = complaint(f"the {what}", getattr(request, what))
            if problem is not None:
                raise RequestRefusedError(problem)
        search = self._counsel.plan(request, time.monotonic())
        place = self._goals.add(search)
        if place is None:
            raise RequestRefusedError("too many goals wait already; cancel some first")
        goal_id, position = place
        self._counsel.consult(goal_id)
        self._wake()
        return SearchAccepted(
            goal_id=goal_id,
            object=search.goal.object,
            position=max(0, position),
            notes=list(search.guidance.notes),
        )

    def control(self, request: ControlRequest) -> ControlReply:
        """Stop, resume, pause or cancel."""
        detail = ""
        match request.action:
            case "stop":
                # The wheels first; the mission learns of it between two frames.
                self._wheels.halt()
                self.put(self._stop)
                state: MissionState = "stopped"
            case "pause":
                self.put(lambda mission: mission.pause())
                state = "paused"
            case "resume":
                self.put(partial(self._resume, self._wheels.halts))
                state = "searching" if self._goals.active() is not None else "starting"
            case "cancel":
                goal, _, _ = self._goals.statuses()
                if goal is None:
                    raise RequestRefusedError("there is no goal to cancel")
                if goal.outcome != "active":
                    detail = f"the search for {goal.object} was over: {goal.outcome}"
                self.put(partial(self._cancel, goal.goal_id))
                state = self.state if self.state == "stopped" else "starting"
        return ControlReply(state=state, detail=detail)

    def feedback(self, request: FeedbackRequest) -> Accepted:
        """Take the operator's word on a find."""
        if self.state != "found":
            raise RequestRefusedError("nothing was found that could be confirmed or rejected")
        if request.verdict == "confirm":
            self.put(self._confirm)
            return Accepted(detail="confirmed")

        self.put(self._reject)
        return Accepted(detail="searching on; this find counts as something else")

    # -- in the mission's thread -------------------------------------------------------------

    def _stop(self, mission: Mission) -> None:
        mission.stop()

    def _confirm(self, mission: Mission) -> None:
        mission.confirm_find()

    def _resume(self, halts: int, mission: Mission) -> None:
        # A stop that came after this resume has the wheels already; its own turn comes next.
        if self._wheels.release(if_count=halts):
            mission.resume()

    def _cancel(self, goal_id: int, mission: Mission) -> None:
        if self._still_active(goal_id) is not None:
            self._goals.conclude("cancelled")
            mission.cancel_goal()

    def _reject(self, mission: Mission) -> None:
        if mission.reject_find():
            self._goals.reopen()

    def _still_active(self, goal_id: int) -> PlannedSearch | None:
        """Return the goal that a request meant, None when another has taken over meanwhile."""
        active = self._goals.active()
        return active if active is not None and active.goal.goal_id == goal_id else None
