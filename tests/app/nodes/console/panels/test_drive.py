"""The Drive tab: its slider shows the speed limit that the navigator has."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from app.messages.driving import DriveStatus
from app.nodes.console.link.commands import CommandError
from app.nodes.console.panels.drive import DrivePanel
from app.view.words import ENGLISH

OPERATOR = SimpleNamespace(client="a browser")
NOBODY = SimpleNamespace(client=None)


@pytest.fixture
def panel():
    """A panel whose handles hold what they are given, as viser's do."""
    gui = MagicMock()
    gui.add_html.side_effect = lambda content, **_: MagicMock(content=content)
    gui.add_slider.side_effect = lambda *_, initial_value, **__: MagicMock(value=initial_value)
    return DrivePanel(gui, MagicMock(say=ENGLISH))


def _show(panel, state="searching", **drive):
    status = SimpleNamespace(drive=DriveStatus(**drive), state=state)
    panel.update(SimpleNamespace(status=status), frozenset({"status"}))


def test_another_mode_keeps_the_limit_that_the_navigator_has(panel):
    _show(panel, speed_limit=0.4)
    assert panel._limit.value == 40
    panel._set_mode("manual")
    panel._actions.set_drive.assert_called_once_with(mode="manual")


def test_another_limit_keeps_the_mode_that_the_navigator_has(panel):
    panel._limit.value = 40
    panel._move_limit(OPERATOR)
    panel._actions.set_drive.assert_called_once_with(speed_limit=0.4)


def test_a_limit_from_the_navigator_is_not_sent_back(panel):
    panel._move_limit(NOBODY)
    panel._actions.set_drive.assert_not_called()


def test_a_limit_that_was_refused_does_not_stay_on_the_slider(panel):
    _show(panel, speed_limit=0.4)
    panel._limit.value = 90
    panel._actions.set_drive.side_effect = CommandError("another browser has control")
    panel._move_limit(OPERATOR)
    assert panel._limit.value == 40


def test_a_stopped_robot_is_not_said_to_drive_by_itself(panel):
    _show(panel, state="stopped")
    assert ENGLISH("panel.drive.stopped.text") in panel._mode_text.content
    _show(panel)
    assert ENGLISH("panel.drive.auto.text") in panel._mode_text.content


def test_the_answer_of_a_way_that_is_over_is_removed(panel):
    panel._answer.content = "Driving there, 10.6 m"
    _show(panel, waypoint=(1.0, 2.0))
    assert panel._answer.content == "Driving there, 10.6 m"
    _show(panel)
    assert panel._answer.content == ""
