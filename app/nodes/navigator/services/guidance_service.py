"""Levels of the goals: from the embedded prior at once, from a language model when it answers.

A search starts on the prior without waiting. The model is asked in a thread of its own; the
mission's thread applies the answer and discards one to an earlier question. Levels that the
operator sets override every answer for that goal.
"""

import dataclasses
import logging
import math
import re
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Final

import numpy as np
import simplejpeg
from numpy.typing import NDArray

from app.links.language_model.interface import LanguageModelInterface, LevelsAnswer
from app.links.language_model.sentence_reading import count_refusal
from app.links.network.requests import RequestRefusedError
from app.messages.control import (
    Accepted,
    GuidanceRequest,
    SearchRequest,
    VocabularyRequest,
)
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.state.planned_search import PlannedSearch, answered
from ippon.guidance.language.naming import ResolvedObject, resolve_object
from ippon.guidance.language.requests.sentence import goal_named
from ippon.guidance.levels import BY_OPERATOR, Guidance, LabelLevel, Level, LevelName
from ippon.guidance.prior import EmbeddedPrior
from ippon.mapping.objects.object_layers import MAX_LABELS
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.rooms.named_rooms import RoomName
from ippon.rooms.room_names import known_rooms
from ippon.vocabulary import canonical_label, in_words

logger = logging.getLogger(__name__)

MAX_LEARNED: Final = 20
"""Largest number of labels that the model may add; each takes memory in every voxel."""
_CONCURRENT_QUESTIONS: Final = 2
"""Concurrent questions, so that one without an answer does not delay the next goal."""
_IN_TOUR: Final = "no common object is added during a search for several objects; add it afterwards"
_FULL: Final = f"the map recognises at most {MAX_LABELS} common objects"
_LABEL: Final = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+){0,3}")

ReportEvent = Callable[[str, str], None]


class GuidanceService:
    """Handles requests in threads of their own and asks the model in its own."""

    def __init__(
        self,
        labels: tuple[str, ...],
        goals: GoalQueue,
        *,
        model: LanguageModelInterface | None,
        look_every_s: float = 0.0,
        operations: OperationQueue,
        report_event: ReportEvent,
    ) -> None:
        self._goals = goals
        self._model = model
        self._look_every_s = look_every_s
        self._looked_at = -math.inf
        self._looking = False
        self._learned = 0
        self._operations = operations
        self._report_event = report_event
        self._prior = EmbeddedPrior()
        self.room_names: Callable[[], tuple[RoomName, ...]] = tuple
        """Returns the names that people have given to rooms; the navigator sets it."""
        self._lock = threading.Lock()
        self._labels = labels
        self._levels_pool = ThreadPoolExecutor(_CONCURRENT_QUESTIONS, thread_name_prefix="levels")
        self._image_pool = ThreadPoolExecutor(1, thread_name_prefix="look")

    @property
    def labels(self) -> tuple[str, ...]:
        """The common objects, in the map's order."""
        with self._lock:
            return self._labels

    def close(self) -> None:
        """Cancel pending questions."""
        if self._model is not None:
            self._model.close()
        for pool in (self._levels_pool, self._image_pool):
            pool.shutdown(wait=False, cancel_futures=True)

    # -- a goal ------------------------------------------------------------------------------

    def plan(self, request: SearchRequest, asked_at: float) -> PlannedSearch:
        """Return the search of a request, with levels of the embedded prior.

        Raises:
            RequestRefusedError: The object holds no word, or more are wanted than are counted.
        """
        resolved = self._resolve(request.object)
        guidance = self._rated(resolved, request.context)
        named = goal_named(request.object)
        attributes, count, other = tuple(request.attributes), request.count, request.other
        if named is not None:
            attributes = attributes or named.attributes
            count = count if count != 1 else named.count
            other = other or named.refers_to == "other"
        if problem := count_refusal(count):
            raise RequestRefusedError(problem)
        goal = Goal(
            goal_id=0,
            object=resolved.canonical,
            display=resolved.display,
            context=request.context,
            category=resolved.category,
            attributes=attributes,
            count=count,
            other=other,
        )
        return PlannedSearch(
            goal=goal,
            resolved=resolved,
            scenario=request.scenario,
            guidance=guidance,
            elapsed_ms=1e3 * (time.monotonic() - asked_at),
            asked_at=asked_at,
        )

    def consult(self, goal_id: int) -> None:
        """Ask the language model, if there is one, for the levels of a goal that has not ended."""
        going_on = (one.goal.goal_id for one in self._goals.unfinished())
        if self._model is None or goal_id not in going_on:
            return
        name = self._model.name
        search = self._goals.amend(
            goal_id, lambda s: dataclasses.replace(s, asking=name, questions=s.questions + 1)
        )
        if search is not None:
            self._levels_pool.submit(self._ask, self._model, search)

    def restore(self, goal_id: int, levels: Mapping[str, LevelName]) -> None:
        """Set levels of a queued goal that the operator had set in an earlier run."""
        for label, level in levels.items():
            self._goals.amend(goal_id, partial(_edited, _edit_of(label, level)))

    def fitted(self, search: PlannedSearch) -> PlannedSearch:
        """Return a search with levels for all present labels; new labels are rated by the prior."""
        labels = self.labels
        if tuple(row.label for row in search.guidance.rows) == labels:
            return search
        rated = self._rated(search.resolved, search.goal.context)
        guidance = search.guidance.over(labels, rated.rows).changed(search.edits)
        fitted = self._goals.amend(
            search.goal.goal_id, lambda s: dataclasses.replace(s, guidance=guidance)
        )
        return fitted or search

    def look(self, color: NDArray[np.uint8]) -> None:
        """Ask the model, when due, for objects in an image; their labels may be added.

        Args:
            color: (H, W, 3) RGB.
        """
        now = time.monotonic()
        due = self._look_every_s > 0.0 and now - self._looked_at >= self._look_every_s
        if self._model is None or not due or self._looking or self._learned >= MAX_LEARNED:
            return
        self._looked_at, self._looking = now, True
        self._image_pool.submit(self._name_objects, self._model, color)

    def notes(self) -> tuple[str, ...]:
        """Return a line for the status while the model's answer is pending or has failed."""
        search = self._goals.active()
        if search is None:
            return ()
        if search.asking:
            return (f"asking {search.asking}; using the {search.guidance.provider} until then",)
        return (f"no answer of the language model: {search.failed}",) if search.failed else ()

    # -- requests ----------------------------------------------------------------------------

    def set_level(self, request: GuidanceRequest) -> Accepted:
        """Change one level of the active goal."""
        active = self._goals.active()
        if active is None:
            raise RequestRefusedError("there is no goal whose levels could change")
        label, labels = canonical_label(request.label), self.labels
        if label not in labels:
            raise RequestRefusedError(
                f"unknown common object {request.label!r}; there are {', '.join(labels)}"
            )
        edit = _edit_of(label, request.level)
        self._operations.enqueue(partial(self._edit, active.goal.goal_id, edit))
        return Accepted(detail=f"{label} is now {request.level}")

    def add_label(self, request: VocabularyRequest) -> Accepted:
        """Add a common object to the map's labels."""
        resolved = self._resolve(request.label)
        label = resolved.canonical
        self._check_new(request.label, label)
        self._operations.enqueue(partial(self._extend, (label,)))
        return Accepted(detail=f"{resolved.display} is recognised from now on")

    def _rated(self, resolved: ResolvedObject, context: str) -> Guidance:
        """Return the levels of the embedded prior, which knows the names of the map's rooms."""
        rooms = known_rooms(context, [room.name for room in self.room_names()])
        return self._prior.levels(resolved, context, self.labels, rooms)

    def _resolve(self, text: str) -> ResolvedObject:
        try:
            return resolve_object(text, self.labels)
        except ValueError as error:
            raise RequestRefusedError(str(error)) from error

    def _check_new(self, asked: str, label: str) -> None:
        if not (_LABEL.fullmatch(canonical_label(asked)) and _LABEL.fullmatch(label)):
            raise RequestRefusedError(
                f"a common object is one to four plain words, like floor lamp; got {asked!r}"
            )
        if label in self.labels:
            known = f"{asked.strip()} is recognised already"
            if canonical_label(asked) != label:
                known = f"{asked.strip()} is recognised already, as {label}"
            raise RequestRefusedError(known)
        if len(self.labels) >= MAX_LABELS:
            raise RequestRefusedError(_FULL)
        if self._goals.in_tour():
            raise RequestRefusedError(_IN_TOUR)
        active = self._goals.active()
        if active is not None and active.goal.object == label:
            raise RequestRefusedError(
                f"{label} is the object of the search and recognised already; add it afterwards"
            )

    # -- in the threads of the model ---------------------------------------------------------

    def _ask(self, model: LanguageModelInterface, search: PlannedSearch) -> None:
        goal_id, labels = search.goal.goal_id, self.labels
        known = self._goals.find(goal_id)
        if known is None or known.questions != search.questions:
            return
        answer = model.levels(
            search.resolved, search.goal.context, labels, scenario=search.scenario
        )
        self._operations.enqueue(partial(self._take, goal_id, search.questions, answer))

    def _name_objects(self, model: LanguageModelInterface, color: NDArray[np.uint8]) -> None:
        try:
            jpeg = simplejpeg.encode_jpeg(np.ascontiguousarray(color), 80, "RGB", "420")
            sighting = model.name_objects(jpeg, self.labels)
            if sighting.failed:
                logger.info("no objects were named: %s", sighting.failed)
            labels = sighting.labels[: MAX_LEARNED - self._learned]
            self._operations.enqueue(partial(self._learn, labels))
        finally:
            self._looking = False

    # -- in the mission's thread -------------------------------------------------------------

    def _take(self, goal_id: int, question: int, answer: LevelsAnswer, mission: Mission) -> None:
        """Apply the model's levels, unless the goal ended or a newer question was asked."""
        known = self._goals.find(goal_id)
        if known is None or known.questions != question:
            logger.info("an answer for goal %d came too late and was dropped", goal_id)
            return
        search = self.fitted(self._goals.amend(goal_id, partial(answered, answer)) or known)
        if self._goals.is_active(goal_id):
            mission.goals.set_guidance(search.guidance, goal_id)
            self._report_event("guidance", _describe(answer, search.guidance))

    def _edit(self, goal_id: int, edit: LabelLevel, mission: Mission) -> None:
        if not self._goals.is_active(goal_id):
            return
        search = self._goals.amend(goal_id, partial(_edited, edit))
        if search is not None:
            mission.goals.set_guidance(search.guidance, goal_id)
            self._report_event("level_changed", f"{edit.label} is {edit.level.text}: {edit.reason}")

    def _extend(self, labels: Sequence[str], mission: Mission) -> None:
        """Add labels to the map, rate them for the active goal, and ask the model once."""
        added: list[str] = []
        for label in labels:
            known, in_tour = mission.voxel_map.labels, mission.goals.tour is not None
            if label in known:
                continue
            if in_tour or len(known) >= MAX_LABELS:
                because = _IN_TOUR if in_tour else _FULL
                self._report_event("error", f"{in_words(label)} was not added: {because}")
                continue
            mission.voxel_map.add_label(label)
            added.append(label)
        if not added:
            return
        with self._lock:
            self._labels = mission.voxel_map.labels
        active = self._goals.active()
        if active is not None:
            mission.goals.set_guidance(self.fitted(active).guidance)
        for label in added:
            self._report_event("vocabulary", f"{in_words(label)} is recognised from now on")
        if active is not None:
            self.consult(active.goal.goal_id)

    def _learn(self, labels: Sequence[str], mission: Mission) -> None:
        """Add the labels that the model saw in an image, under the rules for the operator's."""
        new: list[str] = []
        for label in dict.fromkeys(labels):
            try:
                self._check_new(label, label)
                new.append(label)
            except RequestRefusedError as error:
                logger.info("label not added: %s", error)
        self._learned += len(new)
        self._extend(new, mission)


def _edit_of(label: str, level: LevelName) -> LabelLevel:
    return LabelLevel(label=label, level=Level.parse(level), reason=BY_OPERATOR)


def _edited(edit: LabelLevel, search: PlannedSearch) -> PlannedSearch:
    edits = (*(kept for kept in search.edits if kept.label != edit.label), edit)
    return dataclasses.replace(search, edits=edits, guidance=search.guidance.changed(edits))


def _describe(answer: LevelsAnswer, guidance: Guidance) -> str:
    if answer.failed:
        return guidance.notes[0]
    if answer.from_cache:
        return f"levels of {answer.guidance.provider} from the cache"
    return f"levels of {answer.guidance.provider} after {answer.elapsed_ms:.0f} ms"
