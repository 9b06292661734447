"""The Search tab: the picture of a find."""

from unittest.mock import MagicMock

from app.messages.images import CompressedColor
from app.messages.status import GoalStatus
from app.nodes.console.panels import search
from app.view.model.scene_model import SceneModel
from app.view.words import ENGLISH


def test_the_picture_of_a_find_stays_when_the_find_is_judged(monkeypatch, stage):
    shown = []
    monkeypatch.setattr(search, "show_jpeg_in_panel", lambda _, jpeg: shown.append(jpeg))
    monkeypatch.setattr(search, "outlined", lambda encoded, _: encoded)
    panel = search.SearchPanel(MagicMock(), MagicMock(say=ENGLISH, recorded=False))
    model = SceneModel()
    for image, is_confirmed in ((b"of the find", False), (b"of another room", True)):
        goal = GoalStatus(goal_id=1, object="hat", outcome="found", confirmed=is_confirmed)
        model.on_image(CompressedColor(stamp_ns=1, frame_id="camera", encoded=image))
        model.on_status(stage.status_of("found", goal=goal, find=stage.find_of()))
        panel.update(model, model.take_changes())
    assert shown == [b"of the find"]
