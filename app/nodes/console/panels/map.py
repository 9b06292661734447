"""The Map tab: colour mode, layers and legend of the scene."""

from collections.abc import Callable
from typing import Any, Final

from app.nodes.console.panels import markup
from app.view.colors import QUIET, TREE_LEGEND, ColorMode, LegendEntry, legend
from app.view.model.scene_model import Part, SceneModel
from app.view.view_options import LAYERS, SHOWN_FIRST, Layer, ViewOptions

MODE_WORDS: Final[dict[str, ColorMode]] = {
    "Camera": "camera",
    "Object": "ooi",
    "Proximity": "proximity",
    "Height": "height",
    "Thing": "thing",
    "Gain": "gain",
}
LAYER_WORDS: Final[dict[Layer, str]] = {
    "map": "Voxels",
    "mesh": "Mesh",
    "object": "Object boxes",
    "tree": "Viewpoints",
    "path": "Path",
    "camera": "Camera",
    "trail": "Trail",
    "finds": "Finds",
    "labels": "Names",
    "far_evidence": "Distant candidates",
    "clearance": "Clearance",
}
LAYER_HINTS: Final[dict[Layer, str]] = {
    "mesh": "The same surfaces as a mesh instead of voxels",
    "object": "Boxes around voxels that are likely to be the object",
    "tree": "White: can end the search; black: little gain; blue to red: low to high gain",
    "far_evidence": "Directions in which images show a possible object beyond the range of the map",
    "clearance": "Distance to the nearest obstacle at the height of the robot's body",
    "labels": "The text above found objects",
}
_NO_CUT_M: Final = 4.0
_NO_THING: Final = "–"


def words(label: str) -> str:
    """Return a label with spaces for underscores, as plain text, not escaped for HTML."""
    return label.replace("_", " ")


class MapPanel:
    """Builds the tab inside the current container; calls back with every new choice."""

    def __init__(
        self, gui: Any, on_change: Callable[[ViewOptions], None], on_follow: Callable[[], None]
    ) -> None:
        self._on_change = on_change
        start = ViewOptions()
        self._mode = gui.add_button_group("Colour", tuple(MODE_WORDS))
        self._chosen: ColorMode = start.mode
        self._legend = gui.add_html("")
        self._things: tuple[str, ...] = ()
        self._kinds: tuple[LegendEntry, ...] = ()
        self._thing = gui.add_dropdown(
            "Thing",
            (_NO_THING,),
            hint="Kind of object whose probability the colour mode Thing shows; without one each "
            "surface has the colour of its most probable kind",
        )
        self._ceiling = gui.add_slider(
            "Cut above, m",
            min=0.4,
            max=_NO_CUT_M,
            step=0.1,
            initial_value=start.ceiling_m or _NO_CUT_M,
            hint=f"Hides the map above this height, in metres; {_NO_CUT_M:g} shows everything",
        )
        self._threshold = gui.add_slider(
            "Object threshold",
            min=0.05,
            max=0.95,
            step=0.05,
            initial_value=start.object_threshold,
            hint="Least probability at which a voxel is drawn as an object box",
        )
        with gui.add_folder("Layers"):
            self._layers: dict[Layer, Any] = {
                layer: gui.add_checkbox(
                    LAYER_WORDS[layer],
                    initial_value=layer in SHOWN_FIRST,
                    hint=LAYER_HINTS.get(layer),
                )
                for layer in LAYERS
            }
        gui.add_html(markup.legend(TREE_LEGEND))
        self._frame = gui.add_button("Show the whole map", color=QUIET)
        self._frame.on_click(lambda _: on_follow())
        self._mode.on_click(lambda event: self._choose(event.target.value))
        for handle in (self._ceiling, self._thing, self._threshold, *self._layers.values()):
            handle.on_update(lambda _: self._changed())
        self._show_legend()

    def options(self) -> ViewOptions:
        """Return the current choice."""
        cut = float(self._ceiling.value)
        return ViewOptions(
            mode=self._chosen,
            ceiling_m=None if cut >= _NO_CUT_M else cut,
            object_threshold=float(self._threshold.value),
            thing=self._row(str(self._thing.value)),
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
            self._thing.options = (_NO_THING, *sorted(words(thing) for thing in things))

    def _row(self, thing: str) -> int | None:
        rows = {words(label): n for n, label in enumerate(self._things)}
        return rows.get(thing)

    def _choose(self, word: str) -> None:
        mode = MODE_WORDS.get(word)
        if mode is not None:
            self._chosen = mode
            self._changed()

    def _changed(self) -> None:
        self._show_legend()
        self._on_change(self.options())

    def _show_legend(self) -> None:
        kinds = self._kinds if self._row(str(self._thing.value)) is None else None
        self._legend.content = markup.legend(
            legend(self._chosen, float(self._ceiling.value), kinds), self._chosen
        )
