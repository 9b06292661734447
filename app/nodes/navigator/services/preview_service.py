"""Answers that change nothing: what a voxel is, and what would be chosen with other levels."""

import numpy as np
import zenoh

from app.links.network.requests import RequestRefusedError, serve
from app.messages import keys
from app.messages.control import (
    InspectReply,
    InspectRequest,
    LabelShare,
    PreviewReply,
    PreviewRequest,
)
from app.nodes.navigator.services.mission_queries import Enqueue, MissionQueries
from app.nodes.navigator.state.goal_queue import GoalQueue, PlannedSearch
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.levels import Guidance, LabelLevel, Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.inspection import inspect_voxel
from ippon.vocabulary import canonical_label

PATIENCE_S = 8.0
"""Nobody drives by these answers: they may wait for a slow step and many viewpoints."""


class PreviewService:
    """Everybody may ask."""

    def __init__(self, session: zenoh.Session, robot: str, goals: GoalQueue, put: Enqueue) -> None:
        self._goals = goals
        self._questions = MissionQueries(put, PATIENCE_S)
        self._prior = EmbeddedPrior()
        self._queryables = [
            serve(session, f"{robot}/{keys.INSPECT}", InspectRequest, self.inspect),
            serve(session, f"{robot}/{keys.PREVIEW}", PreviewRequest, self.preview),
        ]

    def inspect(self, request: InspectRequest) -> InspectReply:
        """Return what the map knows of a voxel."""
        point = np.array(request.point_world)
        if not np.isfinite(point).all():
            raise RequestRefusedError(f"a point has three finite numbers; got {point.tolist()}")
        report = self._questions.ask(
            lambda mission: inspect_voxel(mission.voxel_map, point, mission.rooms)
        )
        if report is None:
            raise RequestRefusedError("the map has no surface there")
        return InspectReply(
            labels=[LabelShare(label=name, probability=p) for name, p in report.labels],
            ooi=report.ooi,
            level=None if report.level is None else Level(report.level).name.lower(),  # pyright: ignore[reportArgumentType]
            room=report.room,
        )

    def preview(self, request: PreviewRequest) -> PreviewReply:
        """Return what would be chosen next with another context or other levels."""
        active = self._goals.active()
        if active is None:
            raise RequestRefusedError("levels belong to a goal, and there is none")
        guidance = self._imagined(active, request)
        preview = self._questions.ask(lambda mission: mission.preview(guidance))
        if preview is None:
            raise RequestRefusedError("there is no plan yet; ask again once the robot searches")
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

    def _imagined(self, active: PlannedSearch, request: PreviewRequest) -> Guidance:
        guidance = active.guidance
        labels = tuple(row.label for row in guidance.rows)
        if request.context is not None:
            resolved = resolve_object(active.goal.display, labels)
            guidance = self._prior.levels(resolved, request.context, labels)
        rows: list[LabelLevel] = []
        for name, level in request.levels.items():
            label = canonical_label(name)
            if label not in labels:
                raise RequestRefusedError(
                    f"no common object {name[:80]!r}; there are {', '.join(labels)}"
                )
            rows.append(LabelLevel(label=label, level=Level.parse(level), reason="what if"))
        return guidance.changed(rows)


def _changes(now: Guidance, then: Guidance) -> list[str]:
    return [
        f"{a.label}: {a.level.name.lower()} to {b.level.name.lower()}"
        for a, b in zip(now.rows, then.rows, strict=True)
        if a.level is not b.level
    ]
