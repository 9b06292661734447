"""The thing whose probability is shown is chosen by its name."""

from types import SimpleNamespace
from unittest.mock import MagicMock

from app.nodes.console.panels.map import MapPanel
from app.view.words import Words


def test_a_thing_is_chosen_by_its_name():
    gui = MagicMock()
    for name in ("add_dropdown", "add_slider", "add_checkbox"):
        getattr(gui, name).side_effect = lambda *_, **__: MagicMock(value=1.0, min=0.0, max=4.0)
    panel = MapPanel(gui, lambda _: None, lambda: None, Words("de"))
    rows = [SimpleNamespace(label=label) for label in ("wall", "chest_of_drawers", "bed")]
    model = SimpleNamespace(
        label_colors=SimpleNamespace(entries=()), proximity=SimpleNamespace(rows=rows)
    )
    panel.update(model, frozenset({"proximity"}))
    assert panel._thing.options == ("–", "Bett", "Kommode", "Wand")
    panel._thing.value = "Kommode"
    assert panel.options().thing == 1
    panel._thing.value = "–"
    assert panel.options().thing is None
