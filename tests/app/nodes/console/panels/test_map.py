"""The thing whose probability is shown is chosen by its name."""

from types import SimpleNamespace
from unittest.mock import MagicMock

from app.nodes.console.panels.map import MapPanel
from app.view.view_options import ViewOptions
from app.view.words import Words


def _panel(start):
    def add(*_, initial_value=1.0, **__):
        return MagicMock(value=initial_value, min=0.0, max=4.0)

    gui = MagicMock()
    for name in ("add_dropdown", "add_slider", "add_checkbox"):
        getattr(gui, name).side_effect = add
    return MapPanel(gui, lambda _: None, lambda: None, Words("de"), start)


def _show_things(panel):
    rows = [SimpleNamespace(label=label) for label in ("wall", "chest_of_drawers", "bed")]
    model = SimpleNamespace(
        label_colors=SimpleNamespace(entries=()), proximity=SimpleNamespace(rows=rows)
    )
    panel.update(model, frozenset({"proximity"}))


def test_what_was_chosen_before_holds_again():
    before = ViewOptions(
        mode="thing", ceiling_m=2.0, object_threshold=0.5, thing=1, layers=frozenset({"map"})
    )
    panel = _panel(before)
    _show_things(panel)
    assert panel._thing.value == "Kommode"
    assert panel.options() == before
    # Only once: what is chosen after it stays.
    panel._thing.value = "Bett"
    _show_things(panel)
    assert panel.options().thing == 2


def test_the_legend_of_heights_ends_where_their_colours_do():
    for ceiling_m, text in ((None, "3,0 m"), (2.0, "2,0 m")):
        panel = _panel(ViewOptions(mode="height", ceiling_m=ceiling_m))
        assert text in panel._legend.content


def test_a_thing_is_chosen_by_its_name():
    panel = _panel(ViewOptions())
    _show_things(panel)
    assert panel._thing.options == ("–", "Bett", "Kommode", "Wand")
    panel._thing.value = "Kommode"
    assert panel.options().thing == 1
    panel._thing.value = "–"
    assert panel.options().thing is None
