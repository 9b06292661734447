"""The Session tab: times of the events."""

from unittest.mock import MagicMock

from app.messages.status import Event
from app.nodes.console.panels.session import SessionPanel
from app.view.model import voxel_store
from app.view.model.scene_model import SceneModel
from app.view.model.seek_history import SeekHistory
from app.view.words import ENGLISH

SECOND_NS = 1_000_000_000
DAY_NS = 86_400 * SECOND_NS


def test_the_events_of_another_session_are_timed_from_its_own_start(stage):
    gui = MagicMock()
    gui.add_html.side_effect = lambda content: MagicMock(content=content)
    panel = SessionPanel(gui, MagicMock(recorded=True, say=ENGLISH))
    model = SceneModel()
    for start_ns in (5 * SECOND_NS, 5 * SECOND_NS + DAY_NS):
        past = [stage.status_of("searching", stamp_ns=start_ns)]
        event = Event(stamp_ns=start_ns + 7 * SECOND_NS, kind="query", text="hat")
        model.restore(SeekHistory(statuses=past, events=[event]))
        model.on_status(stage.status_of("searching", stamp_ns=start_ns + 9 * SECOND_NS))
        panel.update(model, model.take_changes())
        assert "<time>0:07</time>" in panel._log.content


def test_a_map_that_is_not_held_as_a_whole_is_told(stage, monkeypatch):
    gui = MagicMock()
    gui.add_html.side_effect = lambda content: MagicMock(content=content)
    panel, model = SessionPanel(gui, MagicMock(recorded=True, say=ENGLISH)), SceneModel()
    status = stage.status_of("searching")
    model.on_status(status)
    monkeypatch.setattr(voxel_store, "MAX_BLOCKS", 1)
    indices, labels = stage.home_voxels()
    for shown in (1, None):
        assert ENGLISH("panel.session.partial") not in panel._warnings.content
        model.on_voxels(stage.cloud_of(indices[:shown], labels[:shown], 1))
        model.on_status(status)
        panel.update(model, model.take_changes())
    assert ENGLISH("panel.session.partial") in panel._warnings.content
