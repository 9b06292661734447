"""What stands in the navigator's place when a recording is shown."""

from types import SimpleNamespace

import pytest

from app.links.network.inbox import Inbox
from app.messages.lease import LeaseStatus
from app.nodes.console.link.commands import CommandError
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.panels.session import SessionPanel
from app.nodes.console.web.browsers import Browser, Browsers
from app.nodes.console.web.viser_server import start_viser
from app.nodes.review.link import RecordedLink


@pytest.fixture
def link():
    return RecordedLink(Inbox([]), print)


def test_whoever_held_control_when_it_was_recorded_keeps_nobody_out(link):
    recorded = SimpleNamespace(lease=LeaseStatus(state="held", holder="Anna", epoch=3))
    link.lease_status = link.lease_in(recorded)
    assert link.lease_status.state == "free"
    assert link.may_use_panels(Browser("x" * 20, "browser 1", "supervisor"))


def test_nothing_is_commanded(link):
    with pytest.raises(CommandError, match="this is a recording"):
        link.pause()


def test_a_recording_has_no_buttons_to_record_it():
    viser_server = start_viser(Browsers())
    try:
        for recorded, link in ((True, RecordedLink(Inbox([]), print)), (False, _live_link())):
            panel = SessionPanel(viser_server.server.gui, link)
            assert (panel._record is None) is recorded
    finally:
        viser_server.close()


def _live_link():
    return NavigatorLink("tcp/127.0.0.1:1", "r", [], Inbox([]), print)
