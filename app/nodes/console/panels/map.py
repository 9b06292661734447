"""The Map tab: colour mode, layers and legend of the scene."""

import math
from collections.abc import Callable
from typing import Any, Final

from app.nodes.console.panels import markup
from app.view.colors import COLOR_MODES, QUIET, ColorMode, LegendEntry, legend, tree_legend
from app.view.drawing.voxel_layer import DEFAULT_TOP_M
from app.view.model.label_colors import with_rest
from app.view.model.scene_model import Part, SceneModel
from app.view.view_options import LAYERS, Layer, ViewOptions
from app.view.words import Words

_HINTED: Final[frozenset[Layer]] = frozenset(
    {"mesh", "object", "tree", "far_evidence", "clearance", "labels"}
)
"""Layers whose name needs an explanation."""
_NO_CUT_M: Final = 4.0
_NO_THING: Final = "–"


class MapPanel:
    """Builds the tab inside the current container; calls back with every new choice."""

    def __init__(
        self,
        gui: Any,
        on_change: Callable[[ViewOptions], None],
        on_follow: Callable[[], None],
        say: Words,
        start: ViewOptions,
    ) -> None:
        self._on_change = on_change
        self._words = say
        self._modes: dict[str, ColorMode] = {say(f"panel.map.{mode}"): mode for mode in COLOR_MODES}
        self._mode = gui.add_button_group(say("panel.map.colour"), tuple(self._modes))
        self._chosen: ColorMode = start.mode
        self._first_thing = start.thing
        """Row of the thing that is chosen as soon as there are names; None for none."""
        self._legend = gui.add_html("")
        self._things: tuple[str, ...] = ()
        self._rows: dict[str, int] = {}
        """Rows of the things by their names."""
        self._kinds: tuple[LegendEntry, ...] = ()
        self._thing = gui.add_dropdown(
            say("panel.map.thing.choice"), (_NO_THING,), hint=say("panel.map.thing.hint")
        )
        self._ceiling = gui.add_slider(
            say("panel.map.cut"),
            min=0.4,
            max=_NO_CUT_M,
            step=0.1,
            initial_value=start.ceiling_m or _NO_CUT_M,
            hint=say("panel.map.cut.hint", most=f"{_NO_CUT_M:g}"),
        )
        self._threshold = gui.add_slider(
            say("panel.map.threshold"),
            min=0.05,
            max=0.95,
            step=0.05,
            initial_value=start.object_threshold,
            hint=say("panel.map.threshold.hint"),
        )
        with gui.add_folder(say("panel.map.layers")):
            self._layers: dict[Layer, Any] = {
                layer: gui.add_checkbox(
                    say(f"panel.map.layer.{layer}"),
                    initial_value=layer in start.layers,
                    hint=say(f"panel.map.layer.{layer}.hint") if layer in _HINTED else None,
                )
                for layer in LAYERS
            }
        gui.add_html(markup.legend(tree_legend(say)))
        self._frame = gui.add_button(say("panel.map.frame"), color=QUIET)
        self._frame.on_click(lambda _: on_follow())
        self._mode.on_click(lambda event: self._choose(event.target.value))
        for handle in (self._ceiling, self._thing, self._threshold, *self._layers.values()):
            handle.on_update(lambda _: self._changed())
        self._show_legend()

    def options(self) -> ViewOptions:
        """Return the current choice."""
        cut = value_of(self._ceiling)
        return ViewOptions(
            mode=self._chosen,
            ceiling_m=None if cut >= _NO_CUT_M else cut,
            object_threshold=value_of(self._threshold),
            thing=self._rows.get(str(self._thing.value)),
            layers=frozenset(layer for layer, box in self._layers.items() if box.value),
        )

    def controls(self) -> tuple[Any, ...]:
        """Return what a browser may change without control of the robot."""
        return (
            self._mode, self._thing, self._ceiling, self._threshold, self._frame,
            *self._layers.values(),
        )  # fmt: skip

    def update(self, model: SceneModel, changed: frozenset[Part]) -> None:
        """Update the list of common objects and the legend of their colours."""
        if model.label_colors.entries != self._kinds:
            self._kinds = model.label_colors.entries
            self._show_legend()
        if "proximity" not in changed or model.proximity is None:
            return
        things = tuple(row.label for row in model.proximity.rows)
        if things and things != self._things:
            self._things = things
            names = self._words.choices(things)
            self._rows = {name: things.index(label) for name, label in names.items()}
            self._thing.options = (_NO_THING, *names)
            first, self._first_thing = self._first_thing, None
            for name, row in self._rows.items():
                if row == first:
                    self._thing.value = name

    def _choose(self, word: str) -> None:
        mode = self._modes.get(word)
        if mode is not None:
            self._chosen = mode
            self._changed()

    def _changed(self) -> None:
        self._show_legend()
        self._on_change(self.options())

    def _show_legend(self) -> None:
        is_one = str(self._thing.value) in self._rows
        kinds = None if is_one else with_rest(self._kinds, self._words)
        top_m = self.options().ceiling_m or DEFAULT_TOP_M
        self._legend.content = markup.legend(
            legend(self._chosen, top_m, self._words, kinds), self._chosen
        )


def value_of(slider: Any) -> float:
    """Return the value of a slider within its range: a browser may send any number."""
    value = float(slider.value)
    return min(max(value, slider.min), slider.max) if math.isfinite(value) else float(slider.max)
