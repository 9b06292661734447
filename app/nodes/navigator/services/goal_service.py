"""Requests about goals: search, stop, resume, pause, cancel, confirm or reject a find."""

import dataclasses
import time
from collections.abc import Callable
from functools import partial
from typing import Final, Protocol

import msgspec

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
from app.messages.status import MissionState, name_of
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.state.availability import Availability
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.state.planned_search import FOUND, PlannedSearch
from ippon.guidance.language.requests.sentence import name_notes
from ippon.memory.instance import Instance
from ippon.memory.lookup import instance_named
from ippon.mission.mission import Mission
from ippon.vocabulary import in_words

_WAITS: Final[dict[MissionState, str]] = {
    "lost": "images or pose of the robot are missing: ippon doctor --robot says why",
    "stopped": "the robot is stopped: the search begins after Resume",
    "paused": "the robot is paused: the search begins after Resume",
    "manual": "a person drives the robot: the search begins in Auto",
}
"""Why the robot does not set out, by its state."""


class StopLatch(Protocol):
    """Holds the robot at zero speed until released; safe from any thread."""

    @property
    def halts(self) -> int:
        """Number of halts so far."""
        ...

    def hold(self) -> None:
        """Let no command pass from now on; `halt` follows. Returns at once and sends nothing."""
        ...

    def halt(self) -> None:
        """Send zero, whatever is commanded, until `release`."""
        ...

    def release(self, if_count: int) -> bool:
        """Pass commands again, if `halts` is still `if_count`; return whether they pass."""
        ...


class GoalService:
    """Validates requests in threads of their own and queues operations for the mission."""

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
        self.availability = Availability(goals)
        self.things: Callable[[], tuple[Instance, ...]] = tuple
        """Returns what is remembered; the navigator sets it."""
        self.state: MissionState = "starting"
        """State of the latest status; the navigator sets it."""

    def search(
        self, request: SearchRequest, copy_of: str = "", *, restores: bool = False
    ) -> SearchAccepted:
        """Plan a search on the embedded prior and queue its goal.

        Args:
            request: What to search for.
            copy_of: What it repeats; one that is searched for or waits is not queued again.
            restores: It is of an earlier run.
        """
        planned = self.plan(request)
        if request.if_free:
            self._check_free()
        search = dataclasses.replace(planned, copy_of=copy_of, if_idle=request.if_free)
        place = self._goals.add(search, request.joins, restores=restores)
        if place is None and request.if_free:
            raise RequestRefusedError("it is not free any more: searching")
        if place is None:
            raise RequestRefusedError("too many goals are waiting; cancel some first")
        if place.is_new:
            self._guidance.consult(place.goal_id)
            self._operations.wake()
        return SearchAccepted(
            goal_id=place.goal_id,
            object=search.goal.object,
            position=place.position,
            notes=[
                *filter(None, [place.note]),
                *filter(None, [_WAITS.get(self.state)]),
                *name_notes(request.object),
                *search.guidance.notes,
            ],
            joined=place.joined,
        )

    def known(self, goal_id: int) -> PlannedSearch | None:
        """Return a goal that is searched for, waits or has ended, by its number."""
        return self._goals.find(goal_id) or self._goals.ended(goal_id)

    def plan(self, request: SearchRequest) -> PlannedSearch:
        """Return the search of a request, with levels of the embedded prior.

        Raises:
            RequestRefusedError: A text is empty, or of no use.
        """
        request, named = self.checked(request)
        search = self._guidance.plan(request, time.monotonic())
        if named is None:
            return search
        goal = dataclasses.replace(search.goal, display=named.name, thing_id=named.instance_id)
        return dataclasses.replace(search, goal=goal)

    def checked(self, request: SearchRequest) -> tuple[SearchRequest, Instance | None]:
        """Return a request by the kind of its object, and the thing that it is about by name.

        Raises:
            RequestRefusedError: A text is empty, or of no use.
        """
        if not request.object.strip():
            raise RequestRefusedError('the object is empty; name an object, such as "hat"')
        texts = {
            "the object": request.object,
            "the context": request.context,
            "the scenario": request.scenario,
        }
        for what, text in texts.items():
            problem = complaint(what, text)
            if problem is not None:
                raise RequestRefusedError(problem)
        named = self._named(request)
        if named is None:
            return request, None
        if not named.believed:
            raise RequestRefusedError(
                f"{named.name!r} is a name, but nobody knows of what: every kind was denied"
            )
        kind = in_words(named.believed)
        left = [one for one in request.attributes if one.kind != "owner"]
        return msgspec.structs.replace(request, object=kind, attributes=left), named

    def _check_free(self) -> None:
        """Refuse a search that could not start at once.

        Raises:
            RequestRefusedError: The robot is not free.
        """
        state = self._operations.ask(_state_of)
        obstacle, detail = self.availability.obstacle(state)
        if obstacle:
            if detail:
                raise RequestRefusedError(f"it is not free any more: {obstacle} ({detail})")
            raise RequestRefusedError(f"it is not free any more: {obstacle}")

    def _named(self, request: SearchRequest) -> Instance | None:
        """Return the thing whose name a request says: as its object, or with its owner."""
        things = self.things()
        owners = [
            one.value for one in request.attributes if one.kind == "owner" and not one.negated
        ]
        texts = (request.object, *(f"{owner}'s {request.object}" for owner in owners))
        found = (instance_named(things, text) for text in texts)
        return next((one for one in found if one is not None), None)

    def hold(self) -> None:
        """Let no command pass: a Stop has come, which `control` answers in its turn."""
        self._stop_latch.hold()

    def control(self, request: ControlRequest) -> ControlReply:
        """Stop, resume, pause or cancel."""
        if request.goal_id is not None and request.action not in ("cancel", "stop"):
            raise RequestRefusedError(
                f"only cancel is about one goal; {request.action} takes no goal_id"
            )
        detail = ""
        match request.action:
            case "stop":
                # The robot stops at once; the mission is told between two frames.
                self._stop_latch.halt()
                self._operations.enqueue_first(self._stop)
                state: MissionState = "stopped"
            case "pause":
                self._operations.enqueue(lambda mission: mission.operator.pause())
                state = "paused"
            case "resume":
                self._operations.enqueue(partial(self._resume, self._stop_latch.halts))
                state = "searching" if self._goals.active() is not None else "starting"
            case "cancel":
                return self._request_cancel(request.goal_id)
        return ControlReply(state=state, detail=detail)

    def feedback(self, request: FeedbackRequest) -> Accepted:
        """Confirm or reject a find."""
        if request.find is not None:
            return self._feedback_by_number(request, request.find)
        goal_id = request.goal_id
        if self._goals.in_tour():
            # The number is fixed now: another find may be announced before the operation runs.
            goal_id = self._goals.announced(goal_id)
            waits = goal_id is not None
        else:
            # By the goal's end: the robot's state may be "stopped", "manual" or "lost" by now.
            lead, _, _ = self._goals.statuses()
            is_lead = lead is not None and goal_id in (None, lead.goal_id)
            waits = lead is not None and is_lead and lead.outcome in FOUND
        if not waits and request.goal_id is None:
            raise RequestRefusedError("there is no find to confirm or reject")
        if not waits:
            raise RequestRefusedError(
                f"there is no find of goal {request.goal_id} to confirm or reject"
            )
        return self._judge(request, goal_id)

    def _feedback_by_number(self, request: FeedbackRequest, number: int) -> Accepted:
        """Confirm or reject one find of several, also one that was counted."""
        if self._goals.in_tour() and request.goal_id is None:
            raise RequestRefusedError(
                f"each goal of a tour numbers its finds; name the goal of find {number}, too"
            )
        judged = self._goals.judged(request.goal_id, number)
        if judged is None or (request.verdict == "reject" and self._is_settled(*judged)):
            raise RequestRefusedError(f"there is no find {number} to confirm or reject")
        goal_id, is_last = judged
        return self._judge(request, goal_id, None if is_last else number)

    def _is_settled(self, goal_id: int, is_last: bool) -> bool:
        """Return whether a tour goes on without what a person has confirmed.

        Args:
            goal_id: Number of the goal.
            is_last: The find ended its search; the others are settled once all are confirmed.
        """
        search = self._goals.find(goal_id)
        if search is None or not self._goals.in_tour() or not search.confirmed:
            return False
        return is_last or all(one.confirmed for one in search.counted)

    def _judge(
        self, request: FeedbackRequest, goal_id: int | None, number: int | None = None
    ) -> Accepted:
        if request.verdict == "confirm":
            self._operations.enqueue(partial(self._confirm, goal_id, number))
            return Accepted(detail="confirmed")
        self._operations.enqueue(partial(self._reject, goal_id, number))
        return Accepted(detail="the search continues; this find is excluded")

    def _request_cancel(self, goal_id: int | None) -> ControlReply:
        """Cancel the present goal or tour, or one goal of it."""
        goal, _, _ = self._goals.statuses()
        tour = self._goals.tour()
        if goal_id is not None:
            known = [*filter(None, [goal]), *tour]
            goal = next((one for one in known if one.goal_id == goal_id), None)
        if goal is None and goal_id is None:
            raise RequestRefusedError("there is no goal to cancel")
        if goal is None:
            raise RequestRefusedError(f"there is no goal with number {goal_id} to cancel")
        one_of_many = goal_id is not None and bool(tour)
        ends = [goal] if one_of_many or not tour else tour
        display = " and ".join(name_of(one) for one in ends if one.outcome == "active")
        if display:
            detail = f"the search for {display} was cancelled"
        else:
            detail = f"the search for {goal.object} had ended: {goal.outcome}"
        self._operations.enqueue(
            partial(self._cancel_one if one_of_many else self._cancel, goal.goal_id)
        )
        goes_on = self.state == "stopped" or one_of_many
        return ControlReply(state=self.state if goes_on else "starting", detail=detail)

    # -- in the mission's thread -------------------------------------------------------------

    def _stop(self, mission: Mission) -> None:
        mission.operator.stop()

    def _confirm(self, goal_id: int | None, number: int | None, mission: Mission) -> None:
        find = self._goals.announced(goal_id) if number is None else None
        if mission.goals.confirm_find(goal_id, number) and find is not None:
            self._goals.confirm(find)

    def _resume(self, halts: int, mission: Mission) -> None:
        # A stop that came after this resume prevails.
        if self._stop_latch.release(if_count=halts):
            mission.operator.resume()

    def _cancel(self, goal_id: int, mission: Mission) -> None:
        # Goals that have ended stay active until the next ones start.
        if self._goals.is_active(goal_id):
            self._goals.conclude("cancelled")
            mission.goals.cancel_goal()

    def _cancel_one(self, goal_id: int, mission: Mission) -> None:
        if self._goals.is_active(goal_id):
            self._goals.conclude("cancelled", goal_id)
            mission.goals.cancel_goal(goal_id)

    def _reject(self, goal_id: int | None, number: int | None, mission: Mission) -> None:
        if mission.goals.reject_find(goal_id, number):
            self._goals.reopen(goal_id)


def _state_of(mission: Mission) -> MissionState:
    return mission.state.value
