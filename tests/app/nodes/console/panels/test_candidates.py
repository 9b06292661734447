"""The list of likeliest places: closing it concerns one goal of one run."""

from unittest.mock import MagicMock

from app.messages.status import GoalStatus
from app.nodes.console.link.commands import CommandError
from app.nodes.console.panels.candidates import CandidatesPanel
from app.view.model.scene_model import SceneModel
from app.view.words import ENGLISH


def test_a_closed_list_opens_for_a_goal_of_that_number_after_a_restart(stage):
    gui, model = MagicMock(), SceneModel()
    panel = CandidatesPanel(gui, MagicMock(say=ENGLISH), MagicMock())
    (close,), _ = gui.add_button.return_value.on_click.call_args

    def end_goal(stamp_ns, took_s):
        goal = GoalStatus(goal_id=1, object="hat", outcome="exhausted", took_s=took_s)
        model.on_status(stage.status_of("searching", stamp_ns=stamp_ns))
        model.on_status(stage.status_of("exhausted", goal=goal, stamp_ns=stamp_ns + 1))
        panel.show(model)
        return model.unfound.latest

    assert end_goal(9_000_000_000, 20.1) is not None
    close(None)
    panel.show(model)
    assert model.unfound.latest is None
    assert end_goal(1_000_000_000, 20.1) is None, "a review shows it again"
    assert end_goal(500_000_000, 31.4) is not None, "the navigator was started again"


def test_a_search_that_has_begun_is_told_although_no_path_leads_to_its_place():
    actions = MagicMock(say=ENGLISH)
    actions.change_queue.return_value = "The goal waits."
    actions.go_to.side_effect = CommandError("no path is known to (1.0, 2.0)")
    panel = CandidatesPanel(MagicMock(), actions, MagicMock())
    place = MagicMock(point_world=(1.0, 2.0, 0.5))
    goal = GoalStatus(goal_id=1, object="hat", outcome="exhausted", took_s=20.0)
    panel._shown = MagicMock(goal=goal, places=[place])
    told = panel._act(0, ENGLISH("panel.places.again"))
    assert told == "The goal waits. No path is known to (1.0, 2.0)."
