"""Finds in the scene: a green frame round the object, and its name."""

from typing import Any, Final

import numpy as np

from app.messages.control import FindReport
from app.messages.scene import Detection
from app.view.colors import FOUND

_MARGIN_M: Final = 0.08
_LABEL_GAP_M: Final = 0.22
_SHOWN: Final = 32
_EDGES: Final = [(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b) in {1, 2, 4}]


class FindLayer:
    """Marks found objects; the names of its nodes are reused."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._boxes: list[Any] = []
        self._labels: list[Any] = []

    def draw(self, finds: tuple[Detection, ...], visible: bool) -> None:
        """Mark these objects and no others."""
        shown = finds[:_SHOWN] if visible else ()
        for n, find in enumerate(shown):
            center = np.array(find.center_world, dtype=np.float32)
            half = np.array(find.size_m, dtype=np.float32) * 0.5 + _MARGIN_M
            corners = np.array(
                [[(n >> axis & 1) * 2 - 1 for axis in range(3)] for n in range(8)], np.float32
            )
            corners = center + corners * half
            segments = np.array([[corners[a], corners[b]] for a, b in _EDGES])
            top = (*center[:2].tolist(), float(center[2] + half[2]) + _LABEL_GAP_M)
            self._mark(n, segments, top, f"{find.label}  {find.probability:.0%}")
        for handle in (*self._boxes[len(shown) :], *self._labels[len(shown) :]):
            handle.visible = False

    def _mark(self, n: int, segments: Any, top: tuple[float, ...], text: str) -> None:
        if n == len(self._boxes):
            self._boxes.append(
                self._scene.add_line_segments(f"/finds/{n}/box", segments, FOUND, thickness=0.04)
            )
            self._labels.append(
                self._scene.add_label(
                    f"/finds/{n}/label", text, anchor="bottom-center", font_screen_scale=1.25
                )
            )
        self._boxes[n].points = segments
        self._boxes[n].visible = True
        self._labels[n].position = top
        self._labels[n].text = text
        self._labels[n].visible = True


def finds_to_show(
    report: FindReport | None, detections: tuple[Detection, ...]
) -> tuple[Detection, ...]:
    """Merge the current find with the detections: the detection of the same thing is left out."""
    if report is None:
        return detections
    current = Detection(
        label=report.object.replace("_", " "),
        probability=report.probability,
        center_world=report.position_world,
        size_m=report.size_m,
    )
    here = np.array(report.position_world)
    others = (d for d in detections if np.abs(here - np.array(d.center_world)).max() > 0.3)
    return (current, *others)
