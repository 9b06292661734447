"""What the conductor does when messages came too fast."""

import pytest

from app.messages import keys
from app.messages.driving import PaintedRegions, PaintedStroke
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.scene.inbox import Inbox
from app.nodes.console.scene.scene_thread import EVERY, Conductor
from app.nodes.console.scene.state_feed import Bulletin
from app.nodes.console.web.browsers import Visitors
from app.nodes.console.web.viser_server import start_viser
from tests.app.nodes.console.drawn_home import status_of


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


def test_what_is_told_on_change_alone_is_fetched_with_the_map_after_a_clock_restarted(backend):
    inbox = Inbox(EVERY)
    link = NavigatorLink("tcp/127.0.0.1:1", "r", [], inbox, print)
    conductor = Conductor(backend, link, inbox, Bulletin(), print)
    model = conductor.model
    model.on_status(status_of(stamp_ns=60_000_000_000))
    model.needs_keyframe = False
    on_map = {keys.MAP_KEYFRAME, keys.FAR_EVIDENCE, keys.PAINTED}
    assert on_map.isdisjoint(conductor._missing())
    stroke = PaintedStroke(kind="look_here", radius_m=0.5, strokes=[(1.0, 2.0)])
    model.on_painted(PaintedRegions(regions=[stroke]))
    model.on_status(status_of(stamp_ns=1_000_000_000))
    assert model.painted == ()
    assert on_map <= set(conductor._missing())
