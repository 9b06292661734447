"""Labels are chosen by their names, and sent as they are."""

from unittest.mock import MagicMock

import pytest

from app.messages.status import LevelRow, LevelTable
from app.nodes.console.link.commands import CommandError
from app.nodes.console.panels.proximity import ProximityPanel
from app.view.words import Words

TABLE = LevelTable(
    goal_id=1,
    object="hat",
    context="",
    provider="embedded prior",
    elapsed_ms=1.0,
    rows=[LevelRow(label=one, level="far", reason="") for one in ("tv", "chest_of_drawers")],
)


def _panel():
    actions = MagicMock(recorded=False, say=Words("de"))
    # Each field is a handle of its own.
    gui = MagicMock()
    for name in ("add_dropdown", "add_text", "add_html", "add_button"):
        getattr(gui, name).side_effect = lambda *_, **__: MagicMock()
    return ProximityPanel(gui, actions), actions


def test_a_level_is_changed_by_the_name_of_its_label():
    panel, actions = _panel()
    panel.show(TABLE)
    assert panel._label.options == ("–", "Fernseher", "Kommode")
    panel._label.value, panel._level.value = "Kommode", "nah"
    panel._change_level()
    actions.set_level.assert_called_once_with("chest_of_drawers", "near")


def test_what_if_takes_no_level_that_nobody_chose():
    panel, actions = _panel()
    panel.show(TABLE)
    panel._label.value, panel._level.value = panel._label.options[0], "nah"
    panel._known.value = "it is next to the bed"
    panel._what_if()
    actions.preview.assert_called_once_with("it is next to the bed", {})
    with pytest.raises(CommandError, match="Wählen Sie zuerst die Art"):
        panel._change_level()


def test_without_a_table_there_is_nothing_to_change():
    panel, actions = _panel()
    panel._label.value, panel._level.value = "–", "nah"
    with pytest.raises(CommandError, match="zuerst eine Suche"):
        panel._change_level()
    actions.set_level.assert_not_called()
