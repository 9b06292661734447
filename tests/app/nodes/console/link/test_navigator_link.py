"""The link to a navigator on real sockets."""

import asyncio
import logging
import threading
import time
from itertools import pairwise
from types import SimpleNamespace

import msgspec
import pytest

from app.links.network import topic_listener
from app.links.network.inbox import Inbox
from app.links.network.session import PROFILE, open_router
from app.messages import keys
from app.messages.control import ControlRequest
from app.messages.driving import TeleopTag
from app.nodes.console.link import navigator_link as link_module
from app.nodes.console.link.commands import CommandError
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.scene.shell_state import waiting_state
from app.nodes.console.web.browsers import Browser, new_session, set_acting_browser
from app.nodes.navigator.run import starting
from app.nodes.navigator.state.lease import Lease
from app.view.words import Words
from ippon.control.drive_mode import TeleopInput
from tests.app.relay import Relay

pytestmark = pytest.mark.process

STOP = ControlRequest(action="stop", requester="test")


def _wait(condition, timeout_s=20.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.fixture
def start_home(stage, port):
    """Starts navigators; all are closed at the end, whatever happens."""
    homes = []

    def start():
        homes.append(stage.PublishedHome(port))
        return homes[-1]

    yield start
    for home in homes:
        home.close()


@pytest.fixture
def port(stage):
    """A port for the navigator."""
    return stage.free_port()


@pytest.fixture
def failures():
    """What has failed."""
    return []


@pytest.fixture
def connect(failures, patient_links):
    """Opens links to ports; all are closed at the end."""
    links = []

    def connect(port):
        endpoint, topics = f"tcp/127.0.0.1:{port}", (keys.STATUS,)
        links.append(NavigatorLink(endpoint, "ippon", topics, Inbox([]), failures.append))
        links[-1].start()
        return links[-1]

    yield connect
    for link in links:
        link.close()


@pytest.fixture
def link(connect, port):
    """A link that is being opened."""
    return connect(port)


@pytest.fixture
def relay(port):
    """A line to the navigator that can be cut."""
    relay = Relay(port)
    yield relay
    relay.close()


def test_a_stop_gets_through_to_a_navigator_that_comes_back(start_home, link, monkeypatch):
    monkeypatch.setattr(link_module, "STOP_S", 60.0)
    home = start_home()
    _wait(lambda: link.is_open)
    home.close()
    answers = []
    asker = threading.Thread(target=lambda: answers.append(link._control(STOP)))
    asker.start()
    time.sleep(1.0)
    again = start_home()
    asker.join(60.0)
    assert answers == ["stopped"]
    assert [key for key, _ in again.requests] == [keys.CONTROL]


def test_a_stop_without_a_navigator_is_given_up_with_a_reason(link, monkeypatch):
    monkeypatch.setattr(link_module, "STOP_S", 0.3)
    with pytest.raises(CommandError, match="no navigator at tcp/"):
        link._control(STOP)


@pytest.mark.parametrize(
    "command",
    [lambda link: link.control(STOP), lambda link: link.lease("renew")],
    ids=["stop", "renewal"],
)
def test_a_stop_or_a_renewal_does_not_wait_for_the_replies_to_other_requests(
    link, monkeypatch, command
):
    released = threading.Event()
    monkeypatch.setattr(link, "_control", lambda _: "done")
    monkeypatch.setattr(link, "_lease", lambda *_: "done")
    monkeypatch.setattr(link, "_request", lambda *_: released.wait(20.0))

    async def ask():
        # More than the threads that the event loop has for them.
        slow = [asyncio.create_task(asyncio.to_thread(link.thing_picture, n)) for n in range(64)]
        await asyncio.sleep(0.1)
        try:
            return await asyncio.wait_for(command(link), 5.0)
        finally:
            released.set()
            await asyncio.gather(*slow, return_exceptions=True)

    assert asyncio.run(ask()) == "done"


def test_silence_does_not_close_the_line_for_commands(start_home, link, monkeypatch):
    monkeypatch.setattr(topic_listener, "SILENT_S", 0.2)
    home = start_home()
    _wait(lambda: link.is_open)
    commanding = link._commanding
    home._stop.set()
    before = link.openings
    _wait(lambda: link.openings >= before + 3)
    assert link._commanding is commanding
    assert link.silence_s() > 0.6, "opening again is no word from the navigator"
    assert link.pause() == "The robot is paused."


def test_a_break_that_zenoh_mends_by_itself_is_noticed(start_home, relay, connect, monkeypatch):
    monkeypatch.setattr(topic_listener, "SILENT_S", 60.0)
    start_home()
    link = connect(relay.port)
    _wait(lambda: link.openings == 1 and link.silence_s() < 0.5)
    listening = link._listener.session
    _wait(lambda: list(listening.liveliness().get(f"ippon/{keys.NAVIGATOR_ALIVE}")))
    relay.cut()
    cut_at = time.monotonic()
    _wait(lambda: link.openings == 2)
    _wait(lambda: link.silence_s() < time.monotonic() - cut_at)
    assert link._listener.session is listening, "no word would have been missed otherwise"


def test_why_it_cannot_connect_is_shown_and_logged_once(connect, port, monkeypatch, caplog):
    caplog.set_level(logging.WARNING)
    monkeypatch.setenv(PROFILE, "/no/profile.json5")
    link = connect(port)
    _wait(lambda: link.problem)
    link._check_sessions()
    text = waiting_state("1", link, "").link_text
    assert text.startswith("IPPON_ZENOH_PROFILE names '/no/profile.json5', which is not a zenoh")
    link.say = Words("de")
    assert "das ist keine zenoh-Konfiguration" in waiting_state("1", link, "").link_text
    warnings = [one for one in caplog.messages if one.startswith("not connected to the navigator")]
    assert len(warnings) == 1


def test_a_navigator_that_compiles_is_told_from_none(port, connect):
    link = connect(port)
    assert waiting_state("1", link, "").starting == ""
    router = open_router(f"tcp/127.0.0.1:{port}")
    try:
        with starting(router, "ippon"):
            _wait(lambda: link.is_compiling)
            assert waiting_state("1", link, "").starting == "compiling"
            assert waiting_state("1", link, "of another version").starting == ""
        _wait(lambda: not link.is_compiling)
    finally:
        router.close()
    link.is_awaited = True
    assert waiting_state("1", link, "").starting == "loading"


def test_what_nobody_expected_is_told(link, failures, monkeypatch):
    def fail(*_):
        raise KeyError("unexpected")

    monkeypatch.setattr(link_module, "open_client", fail)
    _wait(lambda: failures)
    assert isinstance(failures[0], KeyError)


def _sends_to(sent):
    link = NavigatorLink("tcp/127.0.0.1:1", "r", [], Inbox([]), print)
    link._input_publisher = SimpleNamespace(put=lambda _, attachment: sent.append(attachment))
    return link


def test_keys_by_two_consoles_that_serve_one_session_follow_each_other(monkeypatch):
    sent, now_ns = [], [10**18]
    one, other = _sends_to(sent), _sends_to(sent)
    monkeypatch.setattr(link_module, "time", SimpleNamespace(time_ns=lambda: now_ns[0]))
    browser, lease = Browser(new_session(), "Anna", "operator"), Lease()
    browser.update_lease(lease.request(browser.credential(), 0.0))
    set_acting_browser(browser)
    try:
        for link in [one] * 100 + [other, one, other]:
            now_ns[0] += 50_000_000
            link.send_input(TeleopInput(forward=1.0))
        now_ns[0] -= 10**12
        other.send_input(TeleopInput(forward=1.0))
    finally:
        set_acting_browser(None)
    tags = [msgspec.json.decode(attachment, type=TeleopTag) for attachment in sent]
    assert all(tag.follows(before) for before, tag in pairwise(tags))


def test_a_driving_message_counts_for_the_lease_and_carries_no_credential():
    sent = []
    link = _sends_to(sent)
    browser, lease = Browser(new_session(), "Anna", "operator"), Lease()
    browser.update_lease(lease.request(browser.credential(), 0.0))
    set_acting_browser(browser)
    try:
        link.send_input(TeleopInput(forward=1.0))
    finally:
        set_acting_browser(None)
    (attachment,) = sent
    assert browser.session.encode() not in attachment
    tag = msgspec.json.decode(attachment, type=TeleopTag)
    assert lease.teleop_refusal(tag.sender, tag.epoch, 0.1) is None
