"""The panel beside the scene, live and in a review."""

import pytest

from app.links.network.inbox import Inbox
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.panels.search import SearchPanel
from app.nodes.console.panels.tabs import Tabs
from app.nodes.review.link import RecordedLink
from app.view.model.scene_model import SceneModel
from tests.app.unwatched_viser import unwatched_viser

COMMANDS = {"Change the level", "What if?", "Add this kind", "Confirm: this is it"}
GROUPS = {"This search", "Drive mode", "Painted", "Place 1", "Action"}


@pytest.fixture
def server():
    with unwatched_viser() as server:
        yield server


def _shown(server, stage, link):
    """Return the labels of the controls that a search without a find shows, and the tabs."""
    tabs = Tabs(server, link)
    model = SceneModel()
    model.on_proximity(stage.proximity_of())
    for state in ("searching", "exhausted"):
        indices, labels = stage.home_voxels()
        model.on_status(stage.status_of(state))
        model.on_voxels(stage.cloud_of(indices, labels, 1, hat=True))
        tabs.update(model, model.take_changes())
    server.flush()
    buffer = server._websock_server._broadcast_buffer
    made, hidden, names = {}, set(), set()
    for message in buffer.message_from_id.values():
        props = getattr(message, "props", None)
        if hasattr(props, "label") and props.visible:
            made[message.uuid] = props.label
        names |= set(getattr(props, "_tab_labels", ()))
        visible = getattr(message, "updates", {}).get("visible")
        if visible is False:
            hidden.add(message.uuid)
        elif visible:
            hidden.discard(message.uuid)
    return {label for uuid, label in made.items() if uuid not in hidden}, names


def test_a_review_has_no_control_that_commands_a_robot(server, stage):
    recorded = RecordedLink(Inbox(()), pytest.fail)
    shown, tabs = _shown(server, stage, recorded)
    assert tabs == {"Search", "Map", "Session"}
    assert not shown & (COMMANDS | GROUPS)
    assert "Reasons" in shown
    form = SearchPanel(server.gui, recorded).open_form(None, None, pytest.fail)
    assert form is None, "nor has a browser's own part"


def test_live_they_are_there(server, stage):
    live = NavigatorLink("tcp/127.0.0.1:9", "ippon", (), Inbox(()), pytest.fail)
    shown, tabs = _shown(server, stage, live)
    assert tabs == {"Search", "Drive", "Map", "Session"}
    assert shown >= {"What if?", "Drive mode", "Place 1"}
