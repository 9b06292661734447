"""The list of what a search for several has found so far."""

from types import SimpleNamespace

import msgspec
import pytest

from app.messages.status import CountedFind, GoalStatus
from app.nodes.console.link.commands import CommandError
from app.nodes.console.panels.counted_finds import LISTED, CountedFindsPanel, find_name
from app.view.words import ENGLISH


class Gui:
    """Stands in for viser: what is added keeps its content, and can be clicked."""

    def __init__(self):
        self.texts, self.groups = [], []

    def add_html(self, content, visible=True):
        self.texts.append(SimpleNamespace(content=content, visible=visible))
        return self.texts[-1]

    def add_button_group(self, label, options, visible=True):
        group = SimpleNamespace(label=label, options=options, visible=visible)
        group.on_click = lambda act: setattr(group, "act", act)
        self.groups.append(group)
        return group

    def press(self, n, option):
        value = self.groups[n].options[option]
        self.groups[n].act(SimpleNamespace(target=SimpleNamespace(value=value)))


@pytest.fixture
def panel():
    """Return a panel, what it shows, and the verdicts that it sends."""
    gui, sent = Gui(), []
    actions = SimpleNamespace(
        say=ENGLISH,
        recorded=False,
        confirm_find=lambda *which: sent.append(("confirm", *which)),
        reject_find=lambda *which: sent.append(("reject", *which)),
    )
    return CountedFindsPanel(gui, actions, lambda command: command()), gui, sent


def chairs(numbers, confirmed=(), goal_id=4, **changes):
    counted = [
        CountedFind(number=n, position_world=(float(n), 0.0, 0.4), confirmed=n in confirmed)
        for n in numbers
    ]
    fields = {"goal_id": goal_id, "object": "chair", "display": "chairs", "count": "all"}
    return GoalStatus(counted=counted, **fields | changes)


def shown(gui):
    return [text.content for text in gui.texts[1:] if text.visible]


def test_each_find_that_waits_has_buttons_of_its_own(panel, stage):
    finds, gui, sent = panel
    finds.show(stage.status_of(goal=chairs((1, 3, 4), confirmed=(3,))))
    assert ["chair 4" in shown(gui)[0], "chair 1" in shown(gui)[1]] == [True, True]
    assert [group.label for group in gui.groups[:2]] == ["Find 4", "Find 1"]
    assert [group.visible for group in gui.groups] == [True, True] + [False] * (LISTED - 2)
    assert "Confirmed: chair 3" in gui.texts[0].content
    gui.press(1, 1)
    gui.press(0, 0)
    assert sent == [("reject", 4, 1), ("confirm", 4, 4)]
    with pytest.raises(CommandError, match="no longer in the list"):
        gui.press(2, 0)


def test_a_find_keeps_its_row_while_others_come_and_go(panel, stage):
    finds, gui, sent = panel
    finds.show(stage.status_of(goal=chairs((1, 2))))
    gui.press(0, 0)
    finds.show(stage.status_of(goal=chairs((1, 2, 3), confirmed=(2,))))
    with pytest.raises(CommandError, match="no longer in the list"):
        gui.press(0, 0)
    gui.press(1, 0)
    assert ["chair 1" in shown(gui)[0], "chair 3" in shown(gui)[1]] == [True, True]
    assert sent == [("confirm", 4, 2), ("confirm", 4, 1)]
    finds.show(stage.status_of(goal=chairs((1, 2, 3), confirmed=(1, 2, 3))))
    finds.show(stage.status_of(goal=chairs((4, 5), goal_id=5)))
    assert ["chair 5" in shown(gui)[0], "chair 4" in shown(gui)[1]] == [True, True]


def test_what_finds_no_row_is_counted_and_nothing_is_shown_without_a_find(panel, stage):
    finds, gui, _ = panel
    finds.show(stage.status_of(goal=chairs(range(1, LISTED + 3))))
    assert len(shown(gui)) == LISTED
    assert "2 more wait" in gui.texts[0].content
    finds.show(stage.status_of(goal=None))
    assert not any(item.visible for item in (*gui.texts, *gui.groups))


def test_finds_of_a_tour_are_judged_with_their_goal(panel, stage):
    finds, gui, sent = panel
    tour = [chairs((1,)), chairs((1,), goal_id=5, display="cups", object="cup")]
    finds.show(stage.status_of(goal=tour[0], tour=tour))
    assert ["cup 1" in shown(gui)[0], "chair 1" in shown(gui)[1]] == [True, True]
    gui.press(0, 1)
    assert sent == [("reject", 5, 1)]


def test_the_find_that_waits_is_named_where_there_are_several(stage):
    find = msgspec.structs.replace(stage.find_of(), goal_id=4, number=2, object="chair")
    one = chairs((), count=1)
    assert find_name(find, stage.status_of(goal=chairs((1,))), ENGLISH) == "chair 2"
    assert find_name(find, stage.status_of(goal=one), ENGLISH) == ""
    tour = [one, chairs((), goal_id=5)]
    assert find_name(find, stage.status_of(goal=one, tour=tour), ENGLISH) == "chair"
