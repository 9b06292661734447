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
from app.view.words import Words

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
_VALUE: Final = uplot.Axis(**_INK, size=44, gap=4)


class SessionPanel:
    """Builds the tab inside the current container and updates it from the model."""

    def __init__(self, gui: Any, actions: Actions) -> None:
        say = self._words = actions.say
        self._updates = 0
        self._warnings = gui.add_html(markup.warnings(()))
        self._figures = gui.add_html(markup.figures(None, 0, say))
        self._record: RecordPanel | None = None
        if not actions.recorded:
            with gui.add_folder(say("panel.session.recording")):
                self._record = RecordPanel(gui, actions)
        with gui.add_folder(say("panel.session.export")):
            gui.add_html(markup.exports(say))
        with gui.add_folder(say("panel.session.streams")):
            self._streams = gui.add_html(markup.streams((), say))
        with gui.add_folder(say("panel.session.events")):
            self._log = gui.add_html(markup.event_log((), 0, say))
        self._plots = [
            _plot(gui, "best", hex_of(GREEN), say),
            _plot(gui, "explored", hex_of(SKY), say),
            _plot(gui, "path", hex_of(BLUE), say),
            _plot(gui, "step", hex_of(ORANGE), say),
            _plot(gui, "age", hex_of(VERMILION), say),
        ]

    def update(self, model: SceneModel, changed: frozenset[Part]) -> None:
        """Show what changed."""
        if "recording" in changed and self._record is not None:
            self._record.show(model.recorders.statuses)
        status, start_ns = model.status, model.history.first_ns
        if status is None or start_ns is None:
            return
        if "status" in changed:
            partial = [self._words("panel.session.partial")] if model.voxels.refused else []
            self._warnings.content = markup.warnings([*status.notes, *partial])
            self._figures.content = markup.figures(status, model.voxels.count, self._words)
            self._streams.content = markup.streams(status.streams, self._words)
            self._updates += 1
            # A seek in a recording replaces the events and the plotted history.
            if self._updates % _PLOT_EVERY == 1 or "events" in changed:
                self._draw_plots(model.history)
        if "events" in changed:
            self._log.content = markup.event_log(model.events, start_ns, self._words)

    def _draw_plots(self, history: History) -> None:
        columns = history.columns()
        if columns.shape[1] < 2:
            return
        columns[1] *= 100.0
        for plot, row in zip(self._plots, range(1, 6), strict=True):
            plot.data = (columns[0], columns[row])
            plot.visible = True


def _plot(gui: Any, figure: str, color: str, say: Words) -> Any:
    name = say(f"panel.session.plot.{figure}")
    seconds = say("panel.session.seconds")
    time = uplot.Axis(
        **_INK, size=22, gap=2, label=seconds, labelSize=14, labelGap=0, labelFont=_FONT
    )
    return gui.add_uplot(
        data=(np.zeros(1), np.zeros(1)),
        series=(
            uplot.Series(label="s"),
            uplot.Series(label=name, stroke=color, width=2, points=uplot.Series_Points(show=False)),
        ),
        scales={"x": uplot.Scale(time=False)},
        axes=(time, _VALUE),
        title=name,
        legend=uplot.Legend(show=False),
        height=112,
        padding=(12, 8, 0, 0),
        visible=False,
    )
