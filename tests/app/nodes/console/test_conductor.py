"""What the conductor does when messages came too fast."""

import pytest

from app.nodes.console.backend import start_viser
from app.nodes.console.bulletin import Bulletin
from app.nodes.console.conductor import EVERY, Conductor
from app.nodes.console.inbox import Inbox
from app.nodes.console.link import NavigatorLink
from app.nodes.console.visitors import Visitors


@pytest.fixture
def backend():
    backend = start_viser(Visitors())
    yield backend
    backend.close()


def test_what_was_dropped_is_made_up_for_by_a_keyframe(backend, caplog):
    inbox = Inbox(EVERY)
    link = NavigatorLink("tcp/127.0.0.1:1", "r", [], inbox, print)
    conductor = Conductor(backend, link, inbox, Bulletin(), print)
    conductor.model.needs_keyframe = False
    conductor._fetch_if_needed()
    assert not conductor.model.needs_keyframe
    for _ in range(5000):
        inbox.put(EVERY[0], b"a change of the map")
    conductor._fetch_if_needed()
    assert conductor.model.needs_keyframe
    assert "904 messages came too fast: fetching the map anew" in caplog.text
    conductor.model.needs_keyframe = False
    conductor._fetch_if_needed()
    assert not conductor.model.needs_keyframe, "once for each time"
