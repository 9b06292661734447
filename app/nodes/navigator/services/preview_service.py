"""Requests that change nothing: the content of a voxel, and the target under other levels."""

from collections.abc import Callable

import numpy as np

from app.links.network.requests import RequestRefusedError
from app.messages.control import (
    InspectReply,
    InspectRequest,
    LabelShare,
    PreviewReply,
    PreviewRequest,
)
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.state.goal_queue import GoalQueue
from app.nodes.navigator.state.planned_search import PlannedSearch
from ippon.guidance.levels import Guidance, LabelLevel, Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.inspection import inspect_voxel
from ippon.rooms.named_rooms import RoomName
from ippon.rooms.room_names import known_rooms
from ippon.vocabulary import canonical_label

_IN_TOUR = "no preview is given in a search for several objects; ask in a search for one"
TIMEOUT_S = 8.0
"""Time that a request waits for an answer; evaluating many viewpoints may take seconds."""


class PreviewService:
    """Answers requests of everyone, independent of the lease."""

    def __init__(self, goals: GoalQueue, operations: OperationQueue) -> None:
        self._goals = goals
        self._operations = operations
        self._prior = EmbeddedPrior()
        self.room_names: Callable[[], tuple[RoomName, ...]] = tuple
        """Returns the names that people have given to rooms; the navigator sets it."""

    def inspect(self, request: InspectRequest) -> InspectReply:
        """Return label probabilities, object probability and level of a voxel."""
        point = np.array(request.point_world)
        if not np.isfinite(point).all():
            raise RequestRefusedError(f"a point has three finite numbers; got {point.tolist()}")
        report = self._operations.ask(
            lambda mission: inspect_voxel(mission.voxel_map, point, mission.floor_z_m), TIMEOUT_S
        )
        if report is None:
            raise RequestRefusedError("the map has no surface there")
        return InspectReply(
            labels=[LabelShare(label=name, probability=p) for name, p in report.labels],
            ooi=report.ooi,
            level=None if report.level is None else Level(report.level).text,
            room=report.room(),
        )

    def preview(self, request: PreviewRequest) -> PreviewReply:
        """Return the next target under another context or other levels."""
        active = self._goals.active()
        if active is None:
            raise RequestRefusedError("there is no goal whose levels could change")
        if self._goals.in_tour():
            raise RequestRefusedError(_IN_TOUR)
        guidance = self._with_changes(active, request)
        preview = self._operations.ask(lambda mission: mission.preview(guidance), TIMEOUT_S)
        if preview is None:
            raise RequestRefusedError("there is no plan yet; ask again when the robot searches")
        before, after = preview.before, preview.after
        return PreviewReply(
            now=preview.now,
            then=preview.then,
            same=after is not None
            and before is not None
            and after.position_world == before.position_world,
            position_world=None if after is None else after.position_world,
            changed=_changes(active.guidance, guidance),
        )

    def _with_changes(self, active: PlannedSearch, request: PreviewRequest) -> Guidance:
        guidance = active.guidance
        labels = tuple(row.label for row in guidance.rows)
        if request.context is not None:
            guidance = self._in_context(active, request.context, labels)
        rows: list[LabelLevel] = []
        for name, level in request.levels.items():
            label = canonical_label(name)
            if label not in labels:
                raise RequestRefusedError(
                    f"unknown common object {name[:80]!r}; there are {', '.join(labels)}"
                )
            rows.append(LabelLevel(label=label, level=Level.parse(level), reason="what if"))
        return guidance.changed(rows)

    def _in_context(self, active: PlannedSearch, context: str, labels: tuple[str, ...]) -> Guidance:
        """Return the levels in another context; the operator's, and a model's that it leaves, stay.

        What a language model would say is not known: it is not asked.
        """
        names = [room.name for room in self.room_names()]
        now, then = (
            self._prior.levels(active.resolved, said, labels, known_rooms(said, names))
            for said in (active.goal.context, context)
        )
        if active.guidance.provider != then.provider:
            rows = zip(now.rows, then.rows, strict=True)
            then = active.guidance.changed([new for old, new in rows if new.level is not old.level])
        return then.changed(active.edits)


def _changes(now: Guidance, then: Guidance) -> list[str]:
    return [
        f"{a.label}: {a.level.text} to {b.level.text}"
        for a, b in zip(now.rows, then.rows, strict=True)
        if a.level is not b.level
    ]
