"""The Session tab: figures, recording, exports, streams and events."""

from typing import Any, Final

import numpy as np
from viser import uplot

from app.nodes.console.link.commands import Actions
from app.nodes.console.panels import markup
from app.nodes.console.panels.record import RecordPanel
from app.view.colors import BLUE, GREEN, ORANGE, SKY, VERMILION, hex_of
from app.view.model.history import History
from app.view.model.scene_model import Part, SceneModel

_PLOT_EVERY: Final = 5
# Between the inks of the light and of the dark page, because a plot is drawn once for both.
_LINES: Final = "rgba(128, 140, 155, 0.3)"
_FONT: Final = "11px system-ui, sans-serif"
_INK: Final[dict[str, Any]] = {
    "stroke": "#8591a0",
    "grid": uplot.Axis_Grid(stroke=_LINES),
    "ticks": uplot.Axis_Ticks(stroke=_LINES, size=4),
    "font": _FONT,
}
_TIME: Final = uplot.Axis(
    **_INK, size=22, gap=2, label="seconds", labelSize=14, labelGap=0, labelFont=_FONT
)
_VALUE: Final = uplot.Axis(**_INK, size=44, gap=4)


class SessionPanel:
    """Builds the tab inside the current container and updates it from the model."""

    def __init__(self, gui: Any, actions: Actions) -> None:
        self._updates = 0
        self._start_ns: int | None = None
        self._warnings = gui.add_html(markup.warnings(()))
        self._figures = gui.add_html(markup.figures(None, 0))
        self._record: RecordPanel | None = None
        if not actions.recorded:
            with gui.add_folder("Recording"):
                self._record = RecordPanel(gui, actions)
        with gui.add_folder("Export"):
            gui.add_html(markup.EXPORTS)
        with gui.add_folder("Streams"):
            self._streams = gui.add_html(markup.streams(()))
        with gui.add_folder("Events"):
            self._log = gui.add_html(markup.event_log((), 0))
        self._plots = [
            _plot(gui, "Best match, %", hex_of(GREEN)),
            _plot(gui, "Explored, m²", hex_of(SKY)),
            _plot(gui, "Path, m", hex_of(BLUE)),
            _plot(gui, "Navigator step, ms", hex_of(ORANGE)),
            _plot(gui, "Image to command, ms", hex_of(VERMILION)),
        ]

    def update(self, model: SceneModel, changed: frozenset[Part]) -> None:
        """Show what changed."""
        if "recording" in changed and model.recording is not None and self._record is not None:
            self._record.show(model.recording)
        status = model.status
        if status is None:
            return
        if self._start_ns is None or status.stamp_ns < self._start_ns:
            self._start_ns = status.stamp_ns
        if "status" in changed:
            self._warnings.content = markup.warnings(status.notes)
            self._figures.content = markup.figures(status, model.voxels.count)
            self._streams.content = markup.streams(status.streams)
            self._updates += 1
            # A seek in a recording replaces the events and the plotted history.
            if self._updates % _PLOT_EVERY == 1 or "events" in changed:
                self._draw_plots(model.history)
        if "events" in changed:
            self._log.content = markup.event_log(model.events, self._start_ns)

    def _draw_plots(self, history: History) -> None:
        columns = history.columns()
        if columns.shape[1] < 2:
            return
        columns[1] *= 100.0
        for plot, row in zip(self._plots, range(1, 6), strict=True):
            plot.data = (columns[0], columns[row])
            plot.visible = True


def _plot(gui: Any, name: str, color: str) -> Any:
    return gui.add_uplot(
        data=(np.zeros(1), np.zeros(1)),
        series=(
            uplot.Series(label="s"),
            uplot.Series(label=name, stroke=color, width=2, points=uplot.Series_Points(show=False)),
        ),
        scales={"x": uplot.Scale(time=False)},
        axes=(_TIME, _VALUE),
        title=name,
        legend=uplot.Legend(show=False),
        height=112,
        padding=(12, 8, 0, 0),
        visible=False,
    )
