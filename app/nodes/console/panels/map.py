"""The Map tab: what the scene shows, and what its colours mean."""

from collections.abc import Callable
from typing import Any, Final

from app.nodes.console.panels import markup
from app.view.colors import QUIET, TREE_LEGEND, ColorMode, legend
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
    "labels": "Labels",
    "far_evidence": "Seen from afar",
    "covered": "Looked over",
    "clearance": "Clearance",
}
LAYER_HINTS: Final[dict[Layer, str]] = {
    "mesh": "The same surfaces as one closed skin, in place of the voxels",
    "object": "Voxels that are likely to be the object",
    "tree": "White ends the search, black is only on the way, else blue to red by gain",
    "far_evidence": "Where images show what may be the object, beyond the map's range",
    "covered": "Floor that was surely in view from nearby since this object was asked for",
    "clearance": "Distance to the nearest obstacle at the height of the body, every 0.1 m",
    "labels": "What is written above the finds",
}
_NO_CUT_M: Final = 4.0
_NO_THING: Final = "–"


def words(label: str) -> str:
    """Write a label as people do; a plain text for a list, not for HTML."""
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
        self._thing = gui.add_dropdown("Thing", (_NO_THING,), hint="For the colour mode Thing")
        self._ceiling = gui.add_slider(
            "Cut above, m",
            min=0.4,
            max=_NO_CUT_M,
            step=0.1,
            initial_value=start.ceiling_m or _NO_CUT_M,
            hint="Hides what is higher, in metres, so that one looks into the rooms; "
            f"{_NO_CUT_M:g} hides nothing",
        )
        self._threshold = gui.add_slider(
            "Object from",
            min=0.05,
            max=0.95,
            step=0.05,
            initial_value=start.object_threshold,
            hint="Voxels at least this likely to be the object stand out as boxes",
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
        self._frame = gui.add_button("Frame the whole map", color=QUIET)
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
        """Take over the things that the map tells apart."""
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
        self._legend.content = markup.legend(
            legend(self._chosen, float(self._ceiling.value)), self._chosen
        )
