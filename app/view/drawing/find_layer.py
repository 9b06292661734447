"""Finds in the scene as green frames with their names; candidates as thin amber frames."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from app.messages.scene import FoundObject
from app.messages.status import FindReport, Status
from app.view.colors import FOUND, ORANGE, Rgb, linear
from app.view.model.candidates import Candidate
from app.view.words import ENGLISH, Words

_MARGIN_M: Final = 0.08
_LABEL_GAP_M: Final = 0.22
_SHOWN: Final = 32
_SAME_M: Final = 0.3
_REJECTED_M: Final = 0.2
"""Margin around a rejected find that the navigator excludes as well."""
_PLACE_M: Final = 0.4
APART_M: Final = 1.0
"""Least distance between two names."""
_EDGES: Final = [(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b) in {1, 2, 4}]
_SIGNS: Final = np.array(
    [[(n >> axis & 1) * 2 - 1 for axis in range(3)] for n in range(8)], dtype=np.float32
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectMark:
    """A box in the world and its label."""

    center_world: tuple[float, float, float]
    size_m: tuple[float, float, float]
    text: str
    """Label; empty if it would overlap another."""
    found: bool
    """Whether it is a find; otherwise a candidate."""
    hidden: bool = False
    """Whether the map has something before it, as seen by the camera."""


class FindLayer:
    """Draws frames around objects, under reused node names."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._boxes: list[Any] = []
        self._labels: list[Any] = []

    def draw(self, marks: tuple[ObjectMark, ...], visible: bool, named: bool = True) -> None:
        """Replace the drawn marks."""
        shown = marks[:_SHOWN] if visible else ()
        for n, mark in enumerate(shown):
            self._draw_mark(n, mark, named)
        for handle in (*self._boxes[len(shown) :], *self._labels[len(shown) :]):
            handle.visible = False

    def _draw_mark(self, n: int, mark: ObjectMark, named: bool) -> None:
        center = np.array(mark.center_world, dtype=np.float32)
        half = np.array(mark.size_m, dtype=np.float32) * 0.5 + _MARGIN_M
        corners = center + _SIGNS * half
        segments = np.array([[corners[a], corners[b]] for a, b in _EDGES])
        top = (*center[:2].tolist(), float(center[2] + half[2]) + _LABEL_GAP_M)
        color: Rgb = FOUND if mark.found else ORANGE
        colors = np.tile(linear(np.array(color, dtype=np.uint8)), (len(_EDGES), 2, 1))
        if n == len(self._boxes):
            self._boxes.append(self._scene.add_line_segments(f"/finds/{n}/box", segments, colors))
            self._labels.append(
                self._scene.add_label(f"/finds/{n}/label", mark.text, anchor="bottom-center")
            )
        box, label = self._boxes[n], self._labels[n]
        box.points, box.colors, box.visible = segments, colors, True
        box.thickness = 0.04 if mark.found else 0.015
        label.position, label.text, label.visible = top, mark.text, named and bool(mark.text)
        label.font_screen_scale = 1.25 if mark.found else 0.9


def marks_of(
    report: FindReport | None,
    detections: tuple[FoundObject, ...],
    rejected: tuple[FindReport, ...] = (),
    say: Words = ENGLISH,
    *,
    before: tuple[ObjectMark, ...] = (),
    apart_m: float = APART_M,
) -> tuple[ObjectMark, ...]:
    """Return marks of the find and the candidates, the most probable first.

    Candidates inside the find and rejected ones are omitted.

    Args:
        report: The find; None without one.
        detections: The candidates.
        rejected: Finds that were rejected.
        say: The words of the names.
        before: Marks whose names are shown, too.
        apart_m: A candidate that is closer to another name than this has none.
    """
    marks: list[ObjectMark] = []
    detections = tuple(d for d in detections if not any(_is_ruled_out(d, r) for r in rejected))
    if report is not None:
        name = say.name(report.object) + "?" * report.perhaps
        marks.append(
            ObjectMark(
                center_world=report.position_world,
                size_m=report.size_m,
                text=f"{name} {say.percent(report.probability)}",
                found=True,
            )
        )
        detections = tuple(d for d in detections if not _is_part_of(d, report))
    for detection in sorted(detections, key=lambda d: -d.probability):
        text = f"{say.name(detection.label)}? {say.percent(detection.probability)}"
        marks.append(
            ObjectMark(
                center_world=detection.center_world,
                size_m=detection.size_m,
                text=text if _has_room(detection, [*before, *marks], apart_m) else "",
                found=False,
            )
        )
    return tuple(marks)


def places_of(candidates: tuple[Candidate, ...], say: Words = ENGLISH) -> tuple[ObjectMark, ...]:
    """Return marks of the listed candidates of a search without find, with their numbers."""
    return tuple(
        ObjectMark(
            center_world=candidate.point_world,
            size_m=(_PLACE_M, _PLACE_M, _PLACE_M),
            text=f"{n}: {say.percent(candidate.probability)}",
            found=False,
        )
        for n, candidate in enumerate(candidates, start=1)
    )


def found_before(status: Status, say: Words = ENGLISH) -> tuple[ObjectMark, ...]:
    """Return marks of what the search or tour has found before its present find, by number."""
    goals = status.tour or [goal for goal in (status.goal,) if goal is not None]
    marks: list[ObjectMark] = []
    for goal in goals:
        places = {one.number: one.position_world for one in goal.counted}
        is_present = status.find is not None and status.find.goal_id == goal.goal_id
        if goal.outcome == "found" and goal.position_world is not None and not is_present:
            places[goal.find or max(places, default=0) + 1] = goal.position_world
        marks += [
            ObjectMark(
                center_world=place,
                size_m=(_PLACE_M, _PLACE_M, _PLACE_M),
                text=say.find(goal, n),
                found=True,
            )
            for n, place in places.items()
        ]
    return tuple(marks)


def _is_ruled_out(detection: FoundObject, rejected: FindReport) -> bool:
    reach = 0.5 * float(np.linalg.norm(rejected.size_m)) + _REJECTED_M
    offset = np.subtract(detection.center_world, rejected.position_world)
    return float(np.linalg.norm(offset)) <= reach


def _is_part_of(detection: FoundObject, report: FindReport) -> bool:
    offset = np.abs(np.subtract(detection.center_world, report.position_world))
    return bool((offset <= np.maximum(0.5 * np.array(report.size_m), _SAME_M)).all())


def _has_room(detection: FoundObject, marks: list[ObjectMark], apart_m: float) -> bool:
    return all(
        np.linalg.norm(np.subtract(detection.center_world, mark.center_world)) >= apart_m
        for mark in marks
        if mark.text
    )
