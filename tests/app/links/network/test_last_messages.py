"""What was published before a start, or while the line was cut, arrives; nothing older after it."""

import threading
import time
from types import SimpleNamespace

import pytest

from app.links.network import last_messages
from app.links.network.last_messages import request_when_seen
from app.links.network.latched_topic import LatchedReceiver, LatchedTopic
from app.links.network.sender import Sender
from app.links.network.session import open_client
from app.links.network.subscription import subscribe
from app.messages import keys
from tests.app.relay import Relay

PATIENCE_S = 30.0


def _await(condition):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture
def topic(sessions):
    """A latched topic, as a navigator has it."""
    router, _ = sessions
    sender = Sender()
    yield LatchedTopic(router, "r/t", sender)
    sender.close()


@pytest.fixture
def token(sessions):
    """Shows that the navigator is there."""
    token = sessions[0].liveliness().declare_token(f"r/{keys.NAVIGATOR_ALIVE}")
    yield
    token.undeclare()


def _silent():
    return {t for t in threading.enumerate() if t.name == "last messages"} == set()


def test_one_topic_that_nobody_serves_does_not_delay_the_others(sessions, topic, token):
    _, client = sessions
    taken = []
    receivers = {"unserved": LatchedReceiver(print), "t": LatchedReceiver(taken.append)}
    topic.put(b"1")
    request_when_seen(client, "r", receivers)
    _await(lambda: taken == [b"1"])
    _await(_silent)


def test_it_is_requested_until_somebody_replies(sessions, monkeypatch):
    _, client = sessions
    replies = iter([None, None, b"1"])
    monkeypatch.setattr(last_messages, "_AGAIN_S", 0.01)
    monkeypatch.setattr(last_messages, "last_message", lambda *_: next(replies))
    taken = []
    request_when_seen(client, "r", {"t": LatchedReceiver(taken.append)})()
    _await(lambda: taken == [b"1"])
    _await(_silent)
    assert next(replies, "none left") == "none left"


def test_a_topic_whose_reply_was_lost_is_requested_again_and_one_that_nobody_serves_is_not(
    sessions, monkeypatch
):
    _, client = sessions
    asked, now_s = [], [0.0]
    # A busy machine may hold up a request for as long as a reply may take.
    clock = SimpleNamespace(monotonic=lambda: now_s[0], sleep=lambda _: None)
    monkeypatch.setattr(last_messages, "time", clock)

    def last_message(_, key, timeout_s):
        topic = key.removeprefix("r/")
        asked.append(topic)
        if topic == "lost" and asked.count("lost") < 3:
            now_s[0] += timeout_s
            return None
        return None if topic == "unserved" else topic.encode()

    monkeypatch.setattr(last_messages, "last_message", last_message)
    taken = []
    topics = ("lost", "t", "unserved")
    request_when_seen(client, "r", {t: LatchedReceiver(taken.append) for t in topics})()
    _await(lambda: taken == [b"t", b"lost"])
    _await(_silent)
    assert asked == ["lost", "t", "unserved", "lost", "lost"]


@pytest.mark.parametrize("is_seen", [True, False], ids=["seen before", "first seen after"])
def test_what_changed_while_the_line_was_cut_is_requested(
    sessions, topic, free_endpoint, request, is_seen
):
    router, _ = sessions
    if is_seen:
        request.getfixturevalue("token")
    relay = Relay(int(free_endpoint.rsplit(":", 1)[1]))
    client = open_client(f"tcp/127.0.0.1:{relay.port}")
    taken = []
    receiver = LatchedReceiver(taken.append)
    subscribe(client, "r/t", receiver.receive)
    request_when_seen(client, "r", {"t": receiver})
    # What is sent before the subscription has come through is lost.
    _await(lambda: topic.put(b"before") or taken)
    relay.lets_in = False
    relay.cut()
    topic.put(b"meanwhile")
    if not is_seen:
        token = router.liveliness().declare_token(f"r/{keys.NAVIGATOR_ALIVE}")
    time.sleep(0.2)
    assert taken[-1] == b"before"
    relay.lets_in = True
    _await(lambda: taken[-1] == b"meanwhile")
    client.close()
    if not is_seen:
        token.undeclare()
    _await(_silent)
    relay.close()


def test_what_is_wanted_twice_at_once_is_requested_once_more_and_not_at_the_same_time(
    sessions, monkeypatch
):
    _, client = sessions
    began, goes_on, at_once = [], threading.Event(), []

    def last_message(*_):
        began.append(threading.get_ident())
        at_once.append(len([t for t in threading.enumerate() if t.name == "last messages"]))
        assert goes_on.wait(PATIENCE_S)
        return b"1"

    monkeypatch.setattr(last_messages, "last_message", last_message)
    request = request_when_seen(client, "r", {"t": LatchedReceiver(lambda _: None)})
    for _ in range(4):
        request()
    _await(lambda: began)
    request()
    goes_on.set()
    _await(_silent)
    assert len(began) <= 2 + 1
    assert set(at_once) == {1}
    request()
    _await(lambda: len(began) == len(at_once) > 1)
    _await(_silent)


def test_the_requests_end_with_the_session(sessions):
    _, client = sessions
    request_when_seen(client, "r", {"t": LatchedReceiver(print)})()
    time.sleep(0.1)
    assert not _silent()
    client.close()
    _await(_silent)
