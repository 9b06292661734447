"""Requests that change the queue of goals, which they name by number."""

import dataclasses

from app.links.network.requests import RequestRefusedError
from app.messages.control import Accepted, QueueRequest, SearchAccepted, SearchRequest
from app.nodes.navigator.services.goal_service import GoalService
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.state.goal_queue import GoalQueue
from ippon.vocabulary import in_words


class QueueService:
    """Handles requests in threads of their own; the queue itself is safe from any thread."""

    def __init__(self, queue: GoalQueue, guidance: GuidanceService, goals: GoalService) -> None:
        self._queue = queue
        self._guidance = guidance
        self._goals = goals

    def queue(self, request: QueueRequest) -> Accepted:
        """Move, cancel or edit a waiting goal, or repeat an ended one."""
        goal_id = request.goal_id
        match request.action:
            case "first":
                _check_waits(goal_id, waits=self._queue.move_first(goal_id))
                return Accepted(detail="it is next")
            case "before":
                return self._move(request)
            case "remove":
                _check_waits(goal_id, waits=self._queue.remove(goal_id))
                return Accepted(detail="it is cancelled")
            case "edit":
                return self._edit(request)
            case "repeat":
                return self._repeat(goal_id)

    def _move(self, request: QueueRequest) -> Accepted:
        if request.before is None:
            raise RequestRefusedError("before is the number of the goal that it is moved before")
        missing = self._queue.move_before(request.goal_id, request.before)
        if missing is not None:
            _check_waits(missing, waits=False)
        return Accepted(detail=f"goal {request.goal_id} is before goal {request.before}")

    def _edit(self, request: QueueRequest) -> Accepted:
        goal_id = request.goal_id
        old = self._queue.find(goal_id)
        if old is None or self._queue.is_active(goal_id):
            raise RequestRefusedError(f"goal {goal_id} is no longer waiting")
        context = old.goal.context if request.context is None else request.context
        # The page sends the object with every edit.
        is_same = request.object in ("", old.goal.display)
        wanted = SearchRequest(
            object=request.object or old.goal.display,
            context=context,
            scenario=old.scenario,
            attributes=list(old.goal.attributes) if is_same else [],
            count=old.goal.count if is_same else 1,
            other=is_same and old.goal.other,
        )
        new = self._goals.plan(wanted)
        if new.goal.object == old.goal.object:
            edited = new.guidance.changed(old.edits)
            new = dataclasses.replace(new, edits=old.edits, guidance=edited)
        try:
            _check_waits(goal_id, waits=self._queue.edit(goal_id, new))
        except ValueError as error:
            raise RequestRefusedError(str(error)) from error
        self._guidance.consult(goal_id)
        return Accepted(detail=f"goal {goal_id} is: {new.goal.display}")

    def _repeat(self, goal_id: int) -> Accepted:
        old = self._queue.ended(goal_id)
        if old is None:
            raise RequestRefusedError(
                f"goal {goal_id} has not ended in this session, so it cannot be repeated"
            )
        again = SearchRequest(
            object=old.goal.display,
            context=old.goal.context,
            scenario=old.scenario,
            attributes=list(old.goal.attributes),
            count=old.goal.count,
            other=old.goal.other,
        )
        return Accepted(detail=told(self._goals.search(again, copy_of=f"goal {goal_id}")))


def told(accepted: SearchAccepted) -> str:
    """Return an accepted search as a line for the operator."""
    name, before = in_words(accepted.object), accepted.position
    text = f"looking for: {name}"
    if before:
        text = f"looking for: {name}, after {before} other goal{'s' if before > 1 else ''}"
    return "; ".join([text, *accepted.notes])


def _check_waits(goal_id: int, *, waits: bool) -> None:
    if not waits:
        raise RequestRefusedError(f"goal {goal_id} is no longer waiting")
