"""The scene thread fetches the map again when messages were dropped, and forgets recorders."""

import time

import pytest

from app.links.network.inbox import Inbox
from app.messages import keys
from app.messages.control import encode
from app.messages.driving import PaintedRegions, PaintedStroke
from app.messages.recording import RecordingStatus
from app.messages.scene import encode_voxels
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.scene.click_explanation import ClickExplanation
from app.nodes.console.scene.scene_thread import EVERY, RECORDER_S, SceneThread
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.console.web.browsers import Browsers
from app.nodes.console.web.viser_server import start_viser
from app.nodes.review.link import RecordedLink
from app.view.model.seek_history import SeekHistory
from tests.app.nodes.console.drawn_home import status_of
from tests.app.recording.conftest import cloud_of, rows_of


@pytest.fixture
def viser_server():
    viser_server = start_viser(Browsers())
    yield viser_server
    viser_server.close()


def test_what_was_dropped_is_made_up_for_by_a_keyframe(viser_server, caplog):
    inbox = Inbox(EVERY)
    link = NavigatorLink("tcp/127.0.0.1:1", "r", [], inbox, print)
    scene_thread = SceneThread(viser_server, link, inbox, StateFeed(), print)
    scene_thread.model.needs_keyframe = False
    scene_thread._fetch_if_needed()
    assert not scene_thread.model.needs_keyframe
    for _ in range(5000):
        inbox.put(EVERY[0], b"a change of the map")
    scene_thread._fetch_if_needed()
    assert scene_thread.model.needs_keyframe
    assert "904 messages were dropped: fetching the whole map" in caplog.text
    scene_thread.model.needs_keyframe = False
    scene_thread._fetch_if_needed()
    assert not scene_thread.model.needs_keyframe, "once for each time"


def test_what_is_told_on_change_alone_is_fetched_with_the_map_after_a_clock_restarted(viser_server):
    inbox = Inbox(EVERY)
    link = NavigatorLink("tcp/127.0.0.1:1", "r", [], inbox, print)
    scene_thread = SceneThread(viser_server, link, inbox, StateFeed(), print)
    model = scene_thread.model
    model.on_status(status_of(stamp_ns=60_000_000_000))
    model.needs_keyframe = False
    on_map = {keys.MAP_KEYFRAME, keys.FAR_EVIDENCE, keys.PAINTED}
    assert on_map.isdisjoint(scene_thread._missing())
    stroke = PaintedStroke(kind="look_here", radius_m=0.5, strokes=[(1.0, 2.0)])
    model.on_painted(PaintedRegions(regions=[stroke]))
    model.on_status(status_of(stamp_ns=1_000_000_000))
    assert model.painted == ()
    assert on_map <= set(scene_thread._missing())


@pytest.mark.parametrize("is_review", [False, True])
def test_what_was_explained_is_closed_where_the_scene_is_another(viser_server, is_review):
    inbox = Inbox(EVERY)
    link = NavigatorLink("tcp/127.0.0.1:1", "r", [], inbox, print)
    scene_thread = SceneThread(viser_server, link, inbox, StateFeed(), print)
    model, explanations = scene_thread.model, scene_thread._explanations
    model.on_status(status_of(stamp_ns=60_000_000_000))
    explanations.step([], [], scene_thread._fetcher)
    explanations.now = ClickExplanation(number=1, title="Sofa")
    model.on_status(status_of(stamp_ns=60_100_000_000))
    explanations.step([], [], scene_thread._fetcher)
    assert explanations.now is not None
    if is_review:
        model.restore(SeekHistory())
    else:
        model.on_status(status_of(stamp_ns=1_000_000_000))
    explanations.step([], [], scene_thread._fetcher)
    assert explanations.now is None


@pytest.mark.parametrize("recorded", [False, True])
def test_a_whole_map_that_is_not_needed_is_taken_in_a_review_alone(viser_server, recorded):
    inbox = Inbox(EVERY)
    link = NavigatorLink("tcp/127.0.0.1:1", "r", [], inbox, print)
    if recorded:
        link = RecordedLink(inbox, print)
    scene_thread = SceneThread(viser_server, link, inbox, StateFeed(), print)
    scene_thread.model.on_status(status_of())
    whole = cloud_of(40, 1)
    for count in (20, 40):
        cloud = rows_of(whole, slice(count))
        scene_thread._take(keys.MAP_KEYFRAME, encode_voxels(cloud))
    assert scene_thread.model.voxels.count == (40 if recorded else 20)


def test_what_is_missed_while_the_whole_map_is_fetched_is_fetched_again(viser_server, monkeypatch):
    inbox = Inbox(EVERY)
    link = NavigatorLink("tcp/127.0.0.1:1", "r", [], inbox, print)
    scene_thread = SceneThread(viser_server, link, inbox, StateFeed(), print)
    model = scene_thread.model
    model.on_status(status_of())

    def fetch(missed):
        def query(_):
            link._listener.openings += missed
            return encode_voxels(cloud_of(20, 1))

        monkeypatch.setattr(link, "query", query)
        scene_thread._fetch([keys.MAP_KEYFRAME])
        for key, payload in inbox.drain(0.0):
            scene_thread._take(key, payload)
        return model.needs_keyframe

    assert fetch(missed=1)
    assert not fetch(missed=0)


@pytest.mark.parametrize(("state", "left"), [("recording", 0), ("failed", 1)])
def test_a_recorder_that_is_silent_is_not_shown_as_recording(viser_server, state, left):
    inbox = Inbox(EVERY)
    link = NavigatorLink("tcp/127.0.0.1:1", "r", [], inbox, print)
    scene_thread = SceneThread(viser_server, link, inbox, StateFeed(), print)
    status = RecordingStatus(state=state, text="no space", session="sessions/a", seconds=70.0)
    scene_thread._take(keys.RECORDING, encode(status))
    now = time.monotonic()
    scene_thread._notice(now + RECORDER_S - 1.0)
    assert len(scene_thread.model.recorders.statuses) == 1
    scene_thread._notice(now + RECORDER_S + 1.0)
    assert len(scene_thread.model.recorders.statuses) == left
